"""Clients of Dask: of a scheduler that runs already, or of a cluster that a file declares.

The file is for dask-jobqueue, which submits workers to a batch system as jobs.
"""

import logging
import threading
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

from msgspec import Meta, field

from rigwatch.version import __version__
from rigwatch.wire.errors import BatchError, MissingExtraError, one_line
from rigwatch.wire.typed_files import Section, load

CONNECT_S = 15.0
"""Longest wait for a scheduler [s]."""
ANSWER_S = 5.0
"""Longest wait for its first words after that [s]."""
FIRST_WORKER_S = 60.0
"""Longest wait for its first worker [s]."""
KINDS = {
    "htcondor": "HTCondorCluster",
    "local": "local.LocalCluster",
    "lsf": "LSFCluster",
    "moab": "MoabCluster",
    "oar": "OARCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "slurm": "SLURMCluster",
}


QUIET = {
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
    "DASK_DISTRIBUTED__ADMIN__SYSTEM_MONITOR__INTERVAL": "10s",
    "MALLOC_TRIM_THRESHOLD_": str(64 << 20),
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
}
"""Settings of a worker that neither samples its own stack, a hundred times a second, nor looks
whether its event loop turns, fifty times: each takes the interpreter from the work. It looks at
the machine's network and disks every ten seconds, not twice a second. Memory that is freed it
keeps, up to where the C library goes by itself; Dask's own setting gives back each 64 kB, which the
kernel must fill with zeros again, two hundred pages for a recording of ten seconds.
"""


class ClusterFile(Section, frozen=True):
    """A cluster whose workers are jobs of a batch system."""

    kind: Annotated[
        Literal["htcondor", "local", "lsf", "moab", "oar", "pbs", "sge", "slurm"],
        Meta(description="the batch system; local runs the jobs on this machine"),
    ]
    jobs: Annotated[int, Meta(ge=1, le=10_000, description="number of jobs")] = 1
    wait: Annotated[float, Meta(gt=0, description="longest wait for the first worker [s]")] = 3600.0
    options: Annotated[
        dict[str, Any],
        Meta(description="of each job, as dask-jobqueue names them: cores, memory, queue, …"),
    ] = field(default_factory=dict)


def _client_class(purpose: str) -> Any:
    try:
        from distributed import Client
        from distributed.versions import VersionMismatchWarning
    except ImportError:
        raise MissingExtraError("distributed", "dask", purpose) from None
    # A table of all packages; what matters of it is checked.
    warnings.simplefilter("ignore", VersionMismatchWarning)
    # What it logs about a lost connection is said in one line by this program.
    logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)
    return Client


@contextmanager
def client_at(where: str) -> Iterator[Any]:
    """A client of a Dask scheduler whose workers have this version of rigwatch."""
    client = _connected(_client_class("--on dask://"), where)
    try:
        _check_workers(client, where, FIRST_WORKER_S)
        yield client
    finally:
        client.close(timeout=2)


@contextmanager
def client_of(file: Path) -> Iterator[Any]:
    """A client of the cluster that a file declares; its jobs end with it.

    Raises:
        ConfigError: the file is wrong.
        BatchError: the jobs cannot be submitted, or no worker comes.
        MissingExtraError: dask-jobqueue is not installed.
    """
    asked = load(file, ClusterFile)
    kind = _cluster_class(KINDS[asked.kind])
    client_class = _client_class("--on cluster.toml")
    try:
        lines = prologue(asked.kind, asked.options)
        cluster = kind(**asked.options | {"job_script_prologue": lines})
    except (TypeError, ValueError, OSError, RuntimeError) as error:
        raise BatchError(f"{file}: options: {one_line(error)}") from None
    with cluster, client_class(cluster, set_as_default=False) as client:
        cluster.scale(jobs=asked.jobs)
        _check_workers(client, str(file), asked.wait)
        yield client


def _cluster_class(name: str) -> Any:
    try:
        import dask_jobqueue
        import dask_jobqueue.local
    except ImportError:
        raise MissingExtraError("dask_jobqueue", "dask", "--on cluster.toml") from None
    found: Any = dask_jobqueue
    for part in name.split("."):
        found = getattr(found, part)
    return found


def prologue(kind: str, options: dict[str, Any]) -> list[str]:
    """First lines of a job's script; the user's come last, so that they prevail.

    Args:
        kind: of cluster, as in its file.
        options: of the jobs.
    """
    import dask

    quiet = [f"{name}={value}" for name, value in QUIET.items()]
    if kind == "local":  # its script is a single command
        return ["env", *quiet]
    theirs = dask.config.get(f"jobqueue.{kind}.job-script-prologue", None)
    return [f"export {' '.join(quiet)}", *(options.get("job_script_prologue", theirs) or [])]


def _connected(client: Any, where: str) -> Any:
    try:
        host, port = urlsplit(where).hostname, urlsplit(where).port
    except ValueError:
        host = port = None
    if not host:
        raise BatchError(f"--on: found {where!r}, expected dask://host:8786")
    address, made = f"tcp://{host}:{port or 8786}", SimpleQueue[Any]()

    def connect() -> None:
        try:
            made.put(client(address, timeout=CONNECT_S, set_as_default=False))
        except Exception as error:  # whatever the bytes of something else make of Dask
            made.put(error)

    # Dask's timeout is for the connection: what answers and is no scheduler it awaits for ever.
    threading.Thread(target=connect, name="dask", daemon=True).start()
    try:
        found = made.get(timeout=CONNECT_S + ANSWER_S)
    except Empty:
        raise BatchError(f"{where}: what answers there is no scheduler of Dask") from None
    if isinstance(found, Exception):
        raise BatchError(f"{where}: no scheduler of this version answers: {one_line(found)}")
    return found


def _check_workers(client: Any, where: str, wait: float) -> None:
    """Raise if no worker comes, or one cannot load this version of rigwatch or of Dask."""
    try:
        _check_dask(client.get_versions(), where)
        client.wait_for_workers(1, timeout=wait)
        _check_dask(client.get_versions(), where)  # of the workers that have come since
        found = client.run(_version, on_error="return")
    except TimeoutError:
        raise BatchError(f"{where}: the scheduler has no worker, expected at least one") from None
    for worker, version in sorted(found.items()):
        if type(version).__name__ == "CommClosedError":
            continue  # it ended while it was asked: another one comes, or the work waits for one
        if isinstance(version, Exception):
            raise BatchError(f"{where}: worker {worker} cannot load rigwatch: {version}")
        if version != __version__:
            raise BatchError(
                f"{where}: worker {worker} has rigwatch {version}, expected {__version__}"
            )


def _check_dask(found: Mapping[str, Any], where: str) -> None:
    """Raise if scheduler or a worker has another Dask than this process: they may half work."""
    own = found["client"]["packages"]["distributed"]
    workers = {f"worker {name}": of for name, of in sorted(found["workers"].items())}
    for name, of in {"the scheduler": found["scheduler"], **workers}.items():
        its = of["packages"]["distributed"]
        if its != own:
            raise BatchError(f"{where}: {name} has Dask {its}, expected {own} as here")


def _version() -> str:
    return __version__

"""Bombs: each is refused in one line, in seconds, and without the memory that it asks for.

A bomb is made by one process and read by another, which begins with all that reading needs.
"""

import contextlib
import multiprocessing
import multiprocessing.connection
import random
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.malformed.bomb_files import MB, Bomb, bombs
from benchmarks.malformed.recordings import SESSION_SAMPLES, intact_session
from benchmarks.malformed.tables import MAPPING
from rigwatch.wire.errors import MessageError, RigwatchError, SessionError
from rigwatch.wire.exchange import import_file
from rigwatch.wire.messages import SAMPLES, TOPICS, decode
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.session import open_session
from rigwatch.wire.typed_files import parse
from tools.benchmark_table import Row

SEED = 11
LONGEST_S, MOST_MB = 5.0, 300.0
PATIENCE_S = 300.0
FORK = multiprocessing.get_context("fork")
Found = tuple[str, float, float]
"""The refusal, or what it was in place of one in brackets; processor time [s]; memory [MB]."""


def run(quick: bool) -> list[Row]:
    """All of them, also when quick: they take a minute."""
    del quick
    with TemporaryDirectory() as name:
        folder = Path(name)
        kinds = bombs(random.Random(SEED), intact_session(folder))
        found = {
            f"{kind}: {bomb[0]}": _set_off(kind, bomb, folder)
            for kind, some in kinds.items()
            for bomb in some
        }
    bad = [f"{name}: {one}" for name, one in found.items() if not _is_refused(one)]
    slowest, largest = (max(found, key=lambda name: found[name][n]) for n in (1, 2))
    numbers = ", ".join(f"{kind} {len(some)}" for kind, some in kinds.items())
    return [
        Row(
            f"{len(found)} bombs ({numbers})",
            f"{len(found) - len(bad)} refused; at most {found[slowest][1]:.1f} s, "
            f"{found[largest][2]:.0f} MB over the base",
            f"all, {LONGEST_S:g} s, {MOST_MB:g} MB",
            "",
            "; ".join(bad) or f"longest: {slowest}; most memory: {largest}",
            passed=not bad,
        )
    ]


def _is_refused(found: Found) -> bool:
    return not found[0].startswith("(") and found[1] < LONGEST_S and found[2] < MOST_MB


def _set_off(kind: str, bomb: Bomb, folder: Path) -> Found:
    path = folder / f"bomb.{kind}"
    writer = FORK.Process(target=_write, args=(path, bomb))
    writer.start()
    writer.join()
    ours, theirs = FORK.Pipe(duplex=False)
    reader = FORK.Process(target=_tell, args=(theirs, kind, path))
    reader.start()
    theirs.close()
    try:
        found: Found = ours.recv() if ours.poll(PATIENCE_S) else ("(no end)", PATIENCE_S, 0.0)
    except EOFError:
        found = "(the process ended)", 0.0, 0.0
    reader.kill()
    reader.join()
    path.unlink()
    return found


def _write(path: Path, bomb: Bomb) -> None:
    path.write_bytes(bomb[1]())


def _tell(pipe: "multiprocessing.connection.Connection", kind: str, path: Path) -> None:
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # peak: from here on
    base, began = _peak_mb(), time.process_time()
    try:
        READERS[kind](path)
        text = "(read)"
    except RigwatchError as error:
        text = str(error)
    except BaseException as error:
        text = f"({type(error).__name__}: {error})"
    pipe.send((text[:200], time.process_time() - began, _peak_mb() - base))


def _peak_mb() -> float:
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    (peak,) = (line.split()[1] for line in lines if line.startswith("VmHWM"))
    return float(peak) * 1024 / MB


def _read_session(path: Path) -> None:
    """Read what is intact; refused if the rest is told as lost."""
    session = open_session(path)
    assert sum(map(len, session.samples())) <= SESSION_SAMPLES
    if lost := session.lost:
        raise SessionError(f"{path.name}: {lost[0].reason}")


def _import(path: Path) -> None:
    import_file(path, path.with_name("imported.mcap"), MAPPING)


def _read_settings(path: Path) -> None:
    parse(path.read_text(encoding="utf-8"), RigConfig, path.name)


def _decode(path: Path) -> None:
    """Decode as a message of each kind; as samples it must be refused."""
    data = path.read_bytes()
    for topic in TOPICS:
        with contextlib.suppress(MessageError):
            decode(topic.message, data)
    decode(SAMPLES.message, data)


READERS: dict[str, Callable[[Path], None]] = {
    "mcap": _read_session,
    "mat": _import,
    "csv": _import,
    "parquet": _import,
    "toml": _read_settings,
    "protobuf": _decode,
}

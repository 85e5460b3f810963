"""A Dask scheduler and its workers, each a process of its own."""

import json
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Self

import psutil

from rigwatch.batch.dask_clients import QUIET
from tests.waiting import eventually

ROOT = Path(__file__).parents[2]


class Cluster:
    """A scheduler with some workers of one thread each; a worker that is killed is replaced.

    Args:
        folder: for files of the processes.
        workers: number of workers.
        allowed_failures: deaths of workers after which the scheduler gives a task up.
    """

    def __init__(self, folder: Path, workers: int, allowed_failures: int = 3) -> None:
        self._folder, self._count = folder, workers
        self._file = folder / "scheduler.json"
        self._failures = allowed_failures
        self._processes: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        place = ["--scheduler-file", str(self._file)]
        address = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
        self._start("scheduler", [*place, *address])
        eventually(lambda: bool(self.address), "a scheduler")
        size = ["--nworkers", str(self._count), "--nthreads", "1", "--memory-limit", "0"]
        at = ["--no-dashboard", "--local-directory", str(self._folder)]
        self._start("worker", [*place, *size, *at])
        eventually(lambda: self._registered() >= self._count, "all workers")
        return self

    def _registered(self) -> int:
        return (self._folder / "worker.log").read_bytes().count(b"Registered to")

    def _start(self, kind: str, arguments: list[str]) -> None:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *arguments]
        with (self._folder / f"{kind}.log").open("wb") as log:
            env = {
                **os.environ,
                "PYTHONPATH": str(ROOT),
                "OPENBLAS_NUM_THREADS": "1",
                "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(self._failures),
                **QUIET,  # as docs/archive.md says
            }
            self._processes.append(
                subprocess.Popen(command, cwd=ROOT, env=env, stdout=log, stderr=log)
            )

    @property
    def address(self) -> str:
        """As `--on` takes it; "" before the scheduler listens."""
        try:
            told = json.loads(self._file.read_text())
        except (OSError, ValueError):
            return ""
        return str(told["address"]).replace("tcp://", "dask://")

    def workers(self) -> list[psutil.Process]:
        """The processes that run tasks."""
        found = []
        for process in _below(self._processes[1]):
            with suppress(psutil.Error):
                if any("spawn_main" in part for part in process.cmdline()):
                    found.append(process)
        return found

    def end_scheduler(self) -> None:
        """Kill the scheduler."""
        self._processes[0].kill()
        self._processes[0].wait()

    def __exit__(self, *_: object) -> None:
        for process in reversed(self._processes):
            for child in _below(process):
                with suppress(psutil.Error):
                    child.kill()
            process.kill()
            process.wait()


def _below(process: "subprocess.Popen[bytes]") -> list[psutil.Process]:
    try:
        return psutil.Process(process.pid).children(recursive=True)
    except psutil.Error:
        return []

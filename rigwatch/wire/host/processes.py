"""Processes that this one starts, or that started it: their end, and their last words."""

import os
import subprocess
import threading
from multiprocessing import connection, parent_process
from typing import IO, Any


def end_process(process: "subprocess.Popen[Any]", patience: float) -> None:
    """End a process by SIGTERM, or by a kill if it has not ended after `patience` [s]."""
    process.terminate()
    try:
        process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def end_with_parent() -> None:
    """Let this process end when the one that started it does, even by a kill.

    A process that is killed cannot tell those it has started: a thread of theirs watches it.
    """
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_watch, args=(parent.sentinel,), daemon=True).start()


def _watch(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


def last_line(output: IO[bytes]) -> str:
    """The last line of a file that holds a process's output; empty if there is none."""
    output.seek(0)
    lines = output.read().decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else ""

"""Processes that this one starts: their end, and their last words."""

import subprocess
from typing import IO, Any


def end_process(process: "subprocess.Popen[Any]", patience: float) -> None:
    """End a process by SIGTERM, or by a kill if it has not ended after `patience` [s]."""
    process.terminate()
    try:
        process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def last_line(output: IO[bytes]) -> str:
    """The last line of a file that holds a process's output; empty if there is none."""
    output.seek(0)
    lines = output.read().decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else ""

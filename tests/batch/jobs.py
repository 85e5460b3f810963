"""Jobs of the tests, in a module that a worker can import, and files for them to work on."""

import os
import signal
import time
from pathlib import Path
from typing import Any

from rigwatch.version import __version__

ROOT = Path(__file__).parents[2]


def sizes(path: Path, *, pause: float = 0.0) -> dict[str, Any]:
    """Figures of a file; "broken" in it is an error."""
    time.sleep(pause)
    text = path.read_text()
    if "broken" in text:
        raise ValueError("found the word broken,\nexpected a number")
    return {"number": int(text), "third": int(text) / 3, "name": path.name, "list": [1, 2]}


def environment() -> dict[str, str]:
    """The worker's."""
    return dict(os.environ)


def counted(path: Path, *, log: str) -> int:
    """A result that leaves a trace of each call."""
    with Path(log).open("a") as file:
        file.write(f"{path.name}\n")
    return int(path.read_text())


def deadly(path: Path, *, once: str = "", always: str = "") -> int:
    """Kills its worker at some files: the first time, with a mark that it did, or every time."""
    number, mark = int(path.read_text()), Path(once, f"{path.name}.died")
    if always and number in map(int, always.split(",")):
        os.kill(os.getpid(), signal.SIGKILL)
    if once and number % 5 == 0 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def version_or_death(mark: str) -> str:
    """What a worker says of itself; the first that is asked is killed instead."""
    try:
        Path(mark).touch(exist_ok=False)
    except FileExistsError:
        return __version__
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError("a killed process goes on")


def make_files(folder: Path, count: int) -> Path:
    """Files with a number each, called as sessions are."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        (folder / f"run{number:04d}.mcap").write_text(str(number))
    return folder

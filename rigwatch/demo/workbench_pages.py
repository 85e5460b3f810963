"""The workbench in a browser beside the demonstration, where its extra is installed."""

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from rigwatch.demo.rig_file import relative
from rigwatch.wire.host import end_process

STOP_TIMEOUT = 10.0


@dataclass
class Pages:
    """The workbench's pages.

    Attributes:
        address: where they are opened; empty until they are served, and where they cannot be.
    """

    address: str = ""


@contextmanager
def workbench_pages(folder: Path, rig: Path, say: Callable[[str], None]) -> Iterator[Pages]:
    """Serve the studies of `folder` with the page of a rig for as long as this lasts.

    Args:
        folder: of the demonstration; the studies are below it.
        rig: its configuration.
        say: called with lines for people.
    """
    pages = Pages()
    if find_spec("starlette") is None or find_spec("uvicorn") is None:
        yield pages
        return
    studies = folder / "studies"
    studies.mkdir(exist_ok=True)
    say("the dashboard follows, the rig live; a second page, the workbench, with the first alarm")
    process = subprocess.Popen(
        [sys.executable, "-m", "rigwatch", "workbench", str(studies), "--rig", str(rig), "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        process_group=0,
    )
    threading.Thread(target=_learn, args=(process, pages), name="pages", daemon=True).start()
    try:
        yield pages
    finally:
        end_process(process, STOP_TIMEOUT)
        say(f"its studies:   rigwatch workbench {relative(studies)}")


def _learn(process: "subprocess.Popen[str]", pages: Pages) -> None:
    assert process.stdout is not None
    line = process.stdout.readline()
    if line:
        pages.address = json.loads(line)["address"]

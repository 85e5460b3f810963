"""A study of five million samples, simulated and fitted for real."""

import time
from pathlib import Path
from typing import Any

from rigwatch.browser.recordings import make_study
from rigwatch.simulated import write_session
from rigwatch.wire.typed_files import find_file

SAMPLES = 5_000_000
RATE = 256.0
CHANNELS = ("position", "acceleration")
BEGUN = 15.5
"""Start of the part that is held out [s]."""


def make_long(root: Path, name: str, samples: int = SAMPLES) -> float:
    """A recording of the simulated rig and its study, most of it held out; how long it takes [s].

    Five and a half hours in which the mass rubs from 10 s on.
    """
    begun = time.perf_counter()
    folder = root / "recordings"
    folder.mkdir(parents=True, exist_ok=True)
    made = folder / f"{name}.mcap"
    scenario = find_file("friction_stays", "scenarios")
    write_session(made, scenario, seconds=BEGUN + samples / RATE)
    parts = [("train", 10.5, 15.0), ("held_out", BEGUN, None), ("healthy", 4.0, 9.0)]
    make_study(root / name, "rig", [(use, made, start, end) for use, start, end in parts])
    return time.perf_counter() - begun


def show_first(page: Any, name: str, within: float = 3600) -> float:
    """Open the study and wait until it is fitted and drawn; how long that takes [s]."""
    begun = time.perf_counter()
    page.open(f"/study/{name}")
    while not page.run("return Number(document.body.dataset.count || 0) >= 2"):
        assert time.perf_counter() - begun < within, page.text("#job-text")
        time.sleep(0.5)
    return time.perf_counter() - begun

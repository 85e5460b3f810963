"""Example stories: recordings and a model that lacks an effect."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from rigwatch.browser.recordings.new_study import make_study
from rigwatch.simulated import write_session
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.exchange import ImportMapping, import_file
from rigwatch.wire.typed_files import find_file, load
from rigwatch.workbench.study import FILE

DATA = "RIGWATCH_DATA"
EMPS = {"emps": "DATA_EMPS.mat", "emps_pulses": "DATA_EMPS_PULSES.mat"}
RUBBING = 21.0
"""Length of the simulated recording, in which the mass rubs from 10 s on [s]."""


@dataclass(frozen=True)
class Story:
    """One story.

    Attributes:
        name: of the story and of its study.
        title, text: shown to the user.
        hindrance: why it cannot be started; empty if it can.
    """

    name: str
    title: str
    text: str
    hindrance: str = ""


def stories(root: Path) -> list[Story]:
    """Stories that are not in a folder yet."""
    missing = (
        "" if _measured() else f"its recordings are not here: {DATA} names no folder with them"
    )
    told = [
        Story(
            "emps",
            "A measured drive",
            "EMPS, an electro-mechanical positioning system. Three effects are missing; the error"
            " falls from 9.8 N to 2 N, and others are refused.",
            missing,
        ),
        Story(
            "rubbing",
            "A simulated rig that begins to rub",
            "A servo-pneumatic rig with a healthy stretch and one with dry friction of 0.12 N.",
        ),
    ]
    return [story for story in told if not (root / story.name / FILE).exists()]


def begin_story(root: Path, name: str) -> str:
    """Create a story's recordings and its study; returns the study's name.

    Raises:
        RigwatchError: the name is unknown, or one of the story's files exists already.
    """
    if name not in _MADE:
        raise RigwatchError(f"found story {name!r}, expected one of {', '.join(_MADE)}")
    _MADE[name](root)
    return name


def _emps(root: Path) -> None:
    folder, data = root / "recordings", _measured()
    if data is None:
        raise RigwatchError(f"{DATA}: found no folder with the recordings of EMPS")
    folder.mkdir(exist_ok=True)
    for mapping, file in EMPS.items():
        target = folder / f"{mapping}.mcap"
        if not target.exists():
            import_file(data / file, target, load(find_file(mapping, "imports"), ImportMapping))
    train, held_out = (folder / f"{name}.mcap" for name in EMPS)
    make_study(
        root / "emps", "emps", [("train", train, 0.0, None), ("held_out", held_out, 0.0, None)]
    )


def _rubbing(root: Path) -> None:
    folder = root / "recordings"
    folder.mkdir(exist_ok=True)
    made = folder / "rubbing.mcap"
    if not made.exists():
        write_session(made, find_file("friction_stays", "scenarios"), seconds=RUBBING)
    parts = [("train", 10.5, 15.0), ("held_out", 15.5, 20.0), ("healthy", 4.0, 9.0)]
    make_study(root / "rubbing", "rig", [(use, made, a, b) for use, a, b in parts])


def _measured() -> Path | None:
    folder = Path(os.environ.get(DATA, ""), "emps")
    whole = DATA in os.environ and all((folder / file).is_file() for file in EMPS.values())
    return folder if whole else None


_MADE: Mapping[str, Callable[[Path], None]] = {"emps": _emps, "rubbing": _rubbing}

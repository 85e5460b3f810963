"""A folder of recordings in the layout of a foreign rig, played through the commands."""

import json
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

CHANNELS = (
    ("voltage", "voltage_V[V]"),
    ("position", "position_m[m]"),
    ("acceleration", "acceleration_m_s2[m/s^2]"),
)
WEIGHING = 0.01
"""Relative standard deviation of the mass that is weighed."""


@dataclass
class Tally:
    """Right results and totals, by name."""

    right: dict[str, int] = field(default_factory=dict)
    of: dict[str, int] = field(default_factory=dict)

    def count(self, name: str, right: bool) -> None:
        """Counts one case."""
        self.right[name] = self.right.get(name, 0) + int(right)
        self.of[name] = self.of.get(name, 0) + 1

    def add(self, other: "Tally") -> None:
        """Counts all cases of another."""
        for name, of in other.of.items():
            self.right[name] = self.right.get(name, 0) + other.right[name]
            self.of[name] = self.of.get(name, 0) + of

    def __str__(self) -> str:
        return ", ".join(f"{name} {self.right[name]} of {of}" for name, of in self.of.items())


@dataclass(frozen=True)
class RigFolder:
    """Recordings and their truth, and a folder for the results of the commands.

    Attributes:
        recordings: has `truth.json` and a folder of CSV files for each part.
        work: folder of sessions, models and studies.
    """

    recordings: Path
    work: Path

    def truth(self, part: str) -> dict[str, dict[str, Any]]:
        """The truth of each recording of `part`."""
        told = json.loads((self.recordings / "truth.json").read_text(encoding="utf-8"))
        return dict(told.get(part, {}))

    def weighed(self) -> float | None:
        """The moving mass [kg] as a user weighs it, within 1 %; None if the truth lacks it."""
        told = json.loads((self.recordings / "truth.json").read_text(encoding="utf-8"))
        random = np.random.default_rng([*self.recordings.name.encode()])
        error = WEIGHING * float(random.normal())
        return float(told["mass"]) * (1 + error) if "mass" in told else None

    def session(self, part: str, name: str) -> Path:
        """The recording as a session, imported once."""
        session = self.work / part / f"{name}.mcap"
        if not session.exists():
            session.parent.mkdir(parents=True, exist_ok=True)
            maps = [word for to, column in CHANNELS for word in ("--map", f"{to}={column}")]
            source = self.recordings / part / f"{name}.csv"
            run = command("import", source, session, "--time", "time_s[s]", *maps)
            if run.returncode:
                raise RuntimeError(f"import {source}: {run.stderr.strip()}")
        return session

    def commission(self, model: Path, *, weighed: bool = False) -> subprocess.CompletedProcess[str]:
        """`rigwatch commission` from the chirp and all recordings with a locked generator.

        Args:
            model: the file that is written.
            weighed: state the moving mass.
        """
        words: list[str | Path] = ["--chirp", self.session("watch", "chirp")]
        for name in self.truth("watch"):
            role = name.partition("_")[0]
            if role in {"healthy", "friction"} and not name.endswith("_free"):
                words += [f"--{role}", self.session("watch", name)]
        if weighed and (mass := self.weighed()):
            words += ["--set", f"m={mass}"]
        return command("commission", "--output", model, *words)


def command(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs `rigwatch` with these arguments."""
    line = [sys.executable, "-m", "rigwatch", *map(str, words)]
    return subprocess.run(line, capture_output=True, text=True, check=False)


def answer(*words: str | Path) -> tuple[dict[str, Any], str]:
    """A command's JSON output, and its message if it fails."""
    run = command(*words, "--json")
    try:
        return dict(json.loads(run.stdout)), ""
    except ValueError:
        return {}, run.stderr.strip()[-200:] or f"exit {run.returncode}"

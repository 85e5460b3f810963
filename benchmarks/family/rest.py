"""How small a motion counts as rest: drawn rigs whose drive falls, and rigs that are stuck.

    python -m benchmarks.family.rest FOLDER --members calibration --seed 51

Each member is commissioned through the command. A full drive of 8 s is followed by a fraction of
it, or by dry friction of three times the largest force on the mass; the last three of sixteen
seconds count. Motions are of the plant without sensor noise, from largest to smallest.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.family.rig_folder import CHANNELS, RigFolder
from monitor.model import load_model
from monitor.pipeline import RigMonitor
from rigwatch.wire.messages import Column, SampleBlock
from sim_plant.family import FLAVOURS, Member, Scenario, draw, play, write_rig
from sim_plant.family.scenarios import SINE8, tuned_force

RATE, FULL_S, LENGTH_S, JUDGED_S = 256, 8.0, 16.0, 3.0
FACTORS = tuple(float(factor) for factor in np.geomspace(0.1, 1e-4, 13))
"""Shares of the full voltage."""
STUCK = 3.0
"""Dry friction that holds the mass, over the largest force on it."""


@dataclass(frozen=True)
class Seen:
    """One drive: motion and the monitor's view of it.

    Attributes:
        moved: range of the position [m].
        at_rest: share of the samples whose friction cannot be observed.
    """

    moved: float
    at_rest: float


def commissioned(folder: Path, member: Member) -> Path:
    """The model file of a member, made once."""
    if not (folder / "truth.json").exists():
        write_rig(folder, member, ("watch",))
    rig = RigFolder(folder, folder / "work")
    model = rig.work / "model.toml"
    if not model.exists() and (run := rig.commission(model)).returncode:
        raise RuntimeError(run.stderr.strip()[-300:])
    return model


def seen(member: Member, model: Path, scenario: Scenario) -> Seen:
    """A scenario played to a monitor."""
    last = slice(-round(JUDGED_S * RATE), None)
    exact = play(replace(member, noise=(0.0, 0.0)), "rest", scenario)[last, 2]
    monitor = RigMonitor(load_model(model))
    rest = [
        share
        for block in _blocks(play(member, "rest", scenario))
        for share in _rest(monitor, block)
    ]
    return Seen(float(np.ptp(exact)), float(np.mean(rest[last])))


def _rest(monitor: RigMonitor, block: SampleBlock) -> list[float]:
    watched = monitor.update(block)
    assert watched is not None
    columns = {column.name: column.values for column in watched.estimates.columns}
    moving = columns["observable"] > 0.0 if "observable" in columns else columns["rest"] < 1.0
    return [float(not one) for one in moving]


def _blocks(samples: np.ndarray[Any, np.dtype[np.float64]]) -> Iterator[SampleBlock]:
    for first in range(0, len(samples), 32):
        part = samples[first : first + 32]
        times = np.round(part[:, 0] * 1e9).astype(np.int64)
        columns = tuple(
            Column(
                name, words[words.index("[") + 1 : -1], part[:, k], np.zeros(len(part), np.uint8)
            )
            for k, (name, words) in enumerate(CHANNELS, 1)
        )
        yield SampleBlock("rig", 1, first, times // 1000, times, columns)


def fading(factor: float) -> Scenario:
    """A drive that falls to a share of itself."""
    return Scenario("healthy", replace(SINE8, changes=((FULL_S, factor, 1.0),)), LENGTH_S)


def stuck(member: Member) -> Scenario:
    """A full drive of a mass that is held."""
    hidden = {"dry": STUCK * tuned_force(member)}
    return Scenario("stuck", SINE8, LENGTH_S, FULL_S, hidden)


def described(member: Member, model: Path) -> str:
    """One line: limits of rest as ranges of a motion of 8 Hz, with its largest speed."""
    pace = np.pi * SINE8.hz
    fading_motions = [seen(member, model, fading(factor)) for factor in FACTORS]
    held = seen(member, model, stuck(member))
    moving = min((one.moved for one in fading_motions if one.at_rest < 0.5), default=np.nan)
    resting = max((one.moved for one in fading_motions if one.at_rest >= 0.5), default=np.nan)

    def shown(moved: float) -> str:
        return f"{1e6 * moved:.0f} um ({1e3 * pace * moved:.1f} mm/s)"

    return (
        f"{member.name}: smallest motion seen {shown(moving)}, "
        f"largest taken for rest {shown(resting)}; stuck {shown(held.moved)}, at rest "
        f"{100 * held.at_rest:.0f} % of the time"
    )


def main() -> None:
    """Print a line for each member."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.family.rest", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--members", nargs="+", default=list(FLAVOURS), choices=list(FLAVOURS))
    parser.add_argument("--seed", type=int, default=51)
    chosen = parser.parse_args()
    for flavour in chosen.members:
        member = draw(flavour, chosen.seed)
        print(described(member, commissioned(chosen.folder / member.name, member)), flush=True)


if __name__ == "__main__":
    main()

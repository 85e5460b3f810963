"""The monitor on a folder of recordings: quiet on healthy ones, friction named, faults noticed.

Commissioning gets the chirp and the recordings `healthy_*` and `friction_*` with the generator
locked. Hard excitations (`hard_*`) are counted separately. Where the truth states a constant dry
friction, the forces that the alarm tells with the name and last are compared with it; no recording
shows the moving mass, so that they are off by as much as the mass in the model unless it is stated.
"""

import statistics
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from benchmarks.family.rig_folder import RigFolder, Tally, answer

FRICTION = ("dry_friction", "stiction")
ALARM = ("departure", "other_fault", *FRICTION)
EARLY_S = 0.02
"""Largest time of an alarm before its fault that sampling and rounding can cause."""
RATE = 256.0
CLOSE = 0.2
"""Largest relative error of a force that is close to the truth."""


class Raised(NamedTuple):
    """An alarm: its name, when it was told [s], its value, a force [N] if dry friction, and whether
    it stands.
    """

    name: str
    time: float
    value: float
    stands: bool


@dataclass
class Watched:
    """The monitor's results for a folder.

    Attributes:
        tally: quiet, noticed, named, force told last close to the truth, other faults; `hard ...`
            for the hard excitations.
        to_alarm, to_name: latencies after friction begins [ms], without hard ones.
        first_errors, force_errors: relative errors of the force that friction is named with, and
            of that told last, without hard ones.
        miscalled: other faults named friction.
        lines: one for each recording.
    """

    tally: Tally = field(default_factory=Tally)
    to_alarm: list[float] = field(default_factory=list)
    to_name: list[float] = field(default_factory=list)
    first_errors: list[float] = field(default_factory=list)
    force_errors: list[float] = field(default_factory=list)
    miscalled: int = 0
    lines: list[str] = field(default_factory=list)

    def summary(self) -> str:
        """One line."""
        return (
            f"{self.tally}, called friction wrongly {self.miscalled}, "
            f"median ms to alarm {_median(self.to_alarm)}, to name {_median(self.to_name)}, "
            f"median error of the force {_median([100 * abs(e) for e in self.force_errors])} %, "
            f"with the name {_median([100 * abs(e) for e in self.first_errors])} %"
        )


def _median(figures: list[float]) -> str:
    return f"{statistics.median(figures):.0f}" if figures else "-"


def watched(rig: RigFolder, *, weighed: bool = False) -> Watched:
    """Commissions, replays every recording of `watch` and counts.

    Args:
        rig: its recordings.
        weighed: state the moving mass when commissioning.
    """
    found = Watched()
    truth = rig.truth("watch")
    model = rig.work / "model.toml"
    model.unlink(missing_ok=True)
    run = rig.commission(model, weighed=weighed)
    if run.returncode:
        found.lines.append(f"commission: {run.stderr.strip()[-300:]}")
    for name, told in truth.items():
        if name not in {"chirp", "multisine"}:
            alarms, failed = ([], "not commissioned") if run.returncode else _alarms(rig, name)
            _judge(found, name, told, alarms, failed)
    return found


def _alarms(rig: RigFolder, name: str) -> tuple[list[Raised], str]:
    """The alarms that a replay raises, and its failure in words."""
    model = rig.work / "model.toml"
    said, failed = answer("replay", rig.session("watch", name), "--model", model)
    alarms = [
        Raised(
            alarm["name"], alarm["seq"] / RATE, alarm["value"], alarm["state"] == "unacknowledged"
        )
        for alarm in said.get("alarms", [])
        if alarm["name"] in ALARM
    ]
    return alarms, failed


def _judge(
    found: Watched, name: str, told: dict[str, Any], alarms: list[Raised], failed: str
) -> None:
    onset = float(told.get("from_s", float("inf")))
    before = [alarm for alarm in alarms if alarm.time < onset - EARLY_S and onset > 0]
    after = [alarm for alarm in alarms if alarm.time >= onset - EARLY_S]
    named = [alarm for alarm in after if alarm.name in FRICTION]
    hard = "hard " if name.startswith("hard_") else ""
    what = told["what"]
    quiet = not before and not failed
    if what == "other fault":
        called = any(alarm.name in FRICTION for alarm in alarms)
        found.miscalled += called
        right = bool(after) and not called
        found.tally.count("other faults", right)
    else:
        found.tally.count(f"{hard}quiet", quiet)
        right = quiet
    if what == "dry friction":
        found.tally.count(f"{hard}noticed", bool(after))
        found.tally.count(f"{hard}named", bool(named))
        right = quiet and bool(named)
        if not hard:
            found.to_alarm += [1e3 * (after[0].time - onset)] if after else []
            found.to_name += [1e3 * (named[0].time - onset)] if named else []
            _compare_force(found, told, named)
    said = failed or " ".join(f"{alarm.name}@{alarm.time:.2f}" for alarm in alarms[:6])
    found.lines.append(f"{'ok ' if right else 'BAD'} {name:28s} {what[:30]:30s} {said}")


def _compare_force(found: Watched, told: dict[str, Any], named: list[Raised]) -> None:
    """Counts whether the force that is told last is close to the truth, if that is stated."""
    true = told.get("hidden", {}).get("dry")
    given = [alarm.value for alarm in named if alarm.name == "dry_friction" and alarm.stands]
    if true and given:
        first, last = given[0] / true - 1.0, given[-1] / true - 1.0
        found.first_errors.append(first)
        found.force_errors.append(last)
        found.tally.count("force close", abs(last) <= CLOSE)

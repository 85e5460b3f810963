"""The monitor on a folder of recordings: quiet on healthy ones, friction named, faults noticed.

Commissioning gets the chirp and the recordings `healthy_*` and `friction_*` with the generator
locked. Hard excitations (`hard_*`) are counted separately.
"""

import statistics
from dataclasses import dataclass, field
from typing import Any

from benchmarks.family.rig_folder import RigFolder, Tally, answer

FRICTION = ("dry_friction", "stiction")
ALARM = ("departure", "other_fault", *FRICTION)
EARLY_S = 0.02
"""Largest time of an alarm before its fault that sampling and rounding can cause."""
RATE = 256.0


@dataclass
class Watched:
    """The monitor's results for a folder.

    Attributes:
        tally: quiet, noticed, named, other faults; `hard ...` for the hard excitations.
        to_alarm, to_name: latencies after friction begins [ms], without hard ones.
        miscalled: other faults named friction.
        lines: one for each recording.
    """

    tally: Tally = field(default_factory=Tally)
    to_alarm: list[float] = field(default_factory=list)
    to_name: list[float] = field(default_factory=list)
    miscalled: int = 0
    lines: list[str] = field(default_factory=list)

    def summary(self) -> str:
        """One line."""
        return (
            f"{self.tally}, called friction wrongly {self.miscalled}, "
            f"median ms to alarm {_median(self.to_alarm)}, to name {_median(self.to_name)}"
        )


def _median(times: list[float]) -> str:
    return f"{statistics.median(times):.0f}" if times else "-"


def watched(rig: RigFolder) -> Watched:
    """Commissions, replays every recording of `watch` and counts."""
    found = Watched()
    truth = rig.truth("watch")
    model = rig.work / "model.toml"
    model.unlink(missing_ok=True)
    run = rig.commission(model)
    if run.returncode:
        found.lines.append(f"commission: {run.stderr.strip()[-300:]}")
    for name, told in truth.items():
        if name not in {"chirp", "multisine"}:
            alarms, failed = ([], "not commissioned") if run.returncode else _alarms(rig, name)
            _judge(found, name, told, alarms, failed)
    return found


def _alarms(rig: RigFolder, name: str) -> tuple[list[tuple[str, float]], str]:
    """Names and times [s] of the alarms that a replay raises."""
    model = rig.work / "model.toml"
    said, failed = answer("replay", rig.session("watch", name), "--model", model)
    alarms = [(alarm["name"], alarm["seq"] / RATE) for alarm in said.get("alarms", [])]
    return [alarm for alarm in alarms if alarm[0] in ALARM], failed


def _judge(
    found: Watched, name: str, told: dict[str, Any], alarms: list[tuple[str, float]], failed: str
) -> None:
    onset = float(told.get("from_s", float("inf")))
    before = [alarm for alarm in alarms if alarm[1] < onset - EARLY_S and onset > 0]
    after = [alarm for alarm in alarms if alarm[1] >= onset - EARLY_S]
    named = [alarm for alarm in after if alarm[0] in FRICTION]
    hard = "hard " if name.startswith("hard_") else ""
    what = told["what"]
    quiet = not before and not failed
    if what == "other fault":
        called = any(alarm[0] in FRICTION for alarm in alarms)
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
            found.to_alarm += [1e3 * (after[0][1] - onset)] if after else []
            found.to_name += [1e3 * (named[0][1] - onset)] if named else []
    said = failed or " ".join(f"{alarm}@{time:.2f}" for alarm, time in alarms[:6])
    found.lines.append(f"{'ok ' if right else 'BAD'} {name:28s} {what[:30]:30s} {said}")

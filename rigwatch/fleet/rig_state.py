"""What is known of one rig, and how bad it is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rigwatch.wire.messages import Alarm, Health

UNREACHABLE, GONE = 100, 90
"""Ranks of a rig whose router does not answer, and of one that lacks a process, has one hang, or
whose monitor does not tell its alarms."""
ERROR = 60
"""Rank from which on a rig needs somebody now."""
_SEVERITY = {"critical": 80, "error": ERROR, "warning": 40, "info": 20}
_ACTIVE = {"unacknowledged": 9, "acknowledged": 5}
_TROUBLED = 10
"""Rank of a process that says it is not well, without an alarm."""
WELL = ("running", "recording", "starting")


@dataclass(frozen=True, slots=True)
class RigState:
    """One rig.

    Attributes:
        rig: its id.
        config: path of its configuration.
        rank: how bad it is, 0 for a rig that runs without an alarm.
        state: why, in words.
        missing: processes that its configuration has and that are not there.
        hung: processes that are there and give no sign of life.
        alarms: its standing alarms, the worst first.
        figures: of its monitor: `samples`, `lost_samples`, `latency_p99_ms`, …
    """

    rig: str
    config: str
    rank: int
    state: str
    missing: tuple[str, ...] = ()
    hung: tuple[str, ...] = ()
    alarms: tuple[Alarm, ...] = ()
    figures: dict[str, float] = field(default_factory=dict)

    @property
    def reachable(self) -> bool:
        """Whether its router answers."""
        return self.rank != UNREACHABLE


def unreachable(rig: str, config: str, why: str) -> RigState:
    """The state of a rig of which nothing is known."""
    return RigState(rig, config, UNREACHABLE, why)


def judged(
    rig: str,
    config: str,
    missing: Sequence[str],
    alarms: Sequence[Alarm] | None,
    healths: Mapping[str, Health],
    *,
    hung: Sequence[str] = (),
) -> RigState:
    """The state of a rig that can be reached.

    Args:
        rig: its id.
        config: path of its configuration.
        missing: processes that are not there.
        alarms: standing ones; None if the monitor is there and does not tell them.
        healths: the last message of each process.
        hung: processes that are there and silent.
    """
    worst = tuple(sorted(alarms or (), key=lambda alarm: (-rank_of(alarm), alarm.t_ns)))
    troubled = [one for one in healths.values() if one.state not in WELL]
    monitor = healths.get("monitor")
    rank, state = 0, "runs"
    lacks = [f"{', '.join(missing)} not there"] if missing else []
    lacks += [f"{', '.join(hung)} hangs: no sign of life"] if hung else []
    lacks += ["monitor does not tell its alarms"] if alarms is None else []
    if lacks:
        rank, state = GONE, "; ".join(lacks)
    elif worst:
        rank, state = rank_of(worst[0]), worst[0].name
    elif troubled:
        rank, state = _TROUBLED, f"{troubled[0].source}: {troubled[0].state}"
    figures = dict(monitor.counters) if monitor else {}
    return RigState(rig, config, rank, state, tuple(missing), tuple(hung), worst, figures)


def rank_of(alarm: Alarm) -> int:
    """How bad an alarm is: by its severity, then whether it holds, then whether it was seen."""
    return _SEVERITY[alarm.severity] + _ACTIVE.get(alarm.state, 0)

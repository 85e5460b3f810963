"""Many rigs as lines of text, and as a page with a section for each."""

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from rigwatch.fleet.rig_state import ERROR, RigState, rank_of
from rigwatch.page import page
from rigwatch.wire.messages import Alarm

HEAD = ("rig", "state", "alarms", "lost", "p99 [ms]", "more")


def as_lines(states: Sequence[RigState]) -> list[str]:
    """A table, the worst first, and a line that sums it up."""
    rows = [HEAD, *map(_cells, states)]
    widths = [max(len(row[at]) for row in rows) for at in range(len(HEAD))]
    table = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
    return [*table, summary(states)]


def _cells(state: RigState) -> tuple[str, ...]:
    lost, latency = (figure(state, name) for name in ("lost_samples", "latency_p99_ms"))
    return (state.rig, state.state, str(len(state.alarms)), lost, latency, command(state))


def figure(state: RigState, name: str) -> str:
    """A figure of the rig's monitor, a dash if there is none."""
    value = state.figures.get(name, math.nan)
    return f"{value:.4g}" if math.isfinite(value) else "–"


def command(state: RigState, name: str = "dashboard") -> str:
    """The command that shows this rig alone."""
    return f"rigwatch {name} {shlex.quote(state.config)}"


def summary(states: Sequence[RigState]) -> str:
    """How many rigs there are, and how many need somebody."""
    unwell = sum(state.rank > 0 for state in states)
    alarms = sum(len(state.alarms) for state in states)
    return f"{len(states)} rigs: {unwell} need attention, {alarms} alarms"


def as_page(states: Sequence[RigState], every_s: float = 0.0) -> str:
    """A page: the table, each row with a link to the rig's section.

    Args:
        states: the worst first.
        every_s: time after which a browser loads the page again [s]; 0 for never.
    """
    return page(__package__, "fleet.html", every_s=every_s, live=False, **_values(states))


def as_live_page(states: Sequence[RigState]) -> str:
    """The same as a page that follows the server, with links to the rigs' dashboards there."""
    return page(__package__, "live.html", live=True, **_values(states))


def as_part(states: Sequence[RigState]) -> str:
    """What changes in a live page: everything below its head."""
    return page(__package__, "rigs.html", live=True, **_values(states))


def _values(states: Sequence[RigState]) -> dict[str, object]:
    return {
        "states": states,
        "summary": summary(states),
        "figure": figure,
        "command": command,
        "colour": colour,
        "alarms_of": alarms_of,
    }


@dataclass(frozen=True, slots=True)
class Standing:
    """A standing alarm of one of the rigs, and how bad it is."""

    rig: str
    alarm: Alarm
    rank: int


def alarms_of(states: Sequence[RigState]) -> list[Standing]:
    """The alarms of all rigs, the worst first."""
    found = [Standing(state.rig, one, rank_of(one)) for state in states for one in state.alarms]
    return sorted(found, key=lambda one: (-one.rank, one.alarm.t_ns))


def colour(rank: int) -> str:
    """The style of a rank, beside the words that say the same."""
    return "good" if rank == 0 else "no" if rank >= ERROR else "warn"

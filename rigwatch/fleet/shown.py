"""Many rigs as lines of text, and as a page with a section for each."""

import math
import shlex
from collections.abc import Sequence

from rigwatch.fleet.rig_state import RigState
from rigwatch.page import page

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
    return f"{len(states)} rigs: {unwell} not well, {alarms} alarms"


def as_page(states: Sequence[RigState], every_s: float = 0.0) -> str:
    """A page: the table, each row with a link to the rig's section.

    Args:
        states: the worst first.
        every_s: time after which a browser loads the page again [s]; 0 for never.
    """
    return page(
        __package__,
        "fleet.html",
        states=states,
        every_s=every_s,
        summary=summary(states),
        figure=figure,
        command=command,
    )

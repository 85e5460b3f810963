"""What the rig's page shows: latest signals, alarms with their probable causes, states."""

import math
from collections import deque
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.bus import ShelvedAlarm
from rigwatch.wire.messages import (
    STRUCTURE_DAMAGE,
    Alarm,
    EstimateBlock,
    Health,
    SampleBlock,
    columns_of,
    is_of_structure,
    is_remembered,
    json_fields,
    remember,
)

SECONDS = 20.0
"""Time span shown [s]."""
SHOWN_RATE = 64.0
"""Sample rate of the signals shown [Hz]."""
SHOWN_ESTIMATES = ("residual", "theta1", "theta2")
SILENT = 3.0
"""Time without a message after which a process is called silent [s]."""
MISSED = 3.0
"""Samples whose time has to pass before their silence is told, of a rig that takes them slowly."""

Lines = tuple[FloatArray, dict[str, FloatArray]]
"""Times of some samples [s], and values by name."""


class LiveView:
    """Buffers of the page; not thread-safe.

    Args:
        sample_rate: of the rig [Hz].
    """

    def __init__(self, sample_rate: float) -> None:
        self._every = max(1, round(sample_rate / SHOWN_RATE))
        self._silent = max(SILENT, MISSED / sample_rate)
        self._parts: dict[str, deque[tuple[int, Lines]]] = {
            "samples": deque(),
            "estimates": deque(),
        }
        self._count = 0
        self._units: dict[str, str] = {}
        self._alarms: dict[str, Alarm] = {}
        self._missing: set[str] = set()
        self._health: dict[str, tuple[Health, float]] = {}
        self._figures: dict[str, float] = {}
        self._heard: dict[str, float] = {}
        self._shelf: list[ShelvedAlarm] = []

    def standing(self, alarms: list[Alarm]) -> None:
        """Take the list of standing alarms, whose causes name what is probably missing."""
        for alarm in alarms:
            known = self._alarms.get(alarm.name)
            if known is None or known.t_ns <= alarm.t_ns:
                remember(self._alarms, alarm)

    def only(self, standing: list[Alarm]) -> None:
        """Take it that the monitor has no others: those that it no longer lists have ended.

        What ended while the link was down is told by nothing else. An alarm has to be missing in
        two lists in a row, as one that is raised meanwhile may come before the list that has it.
        """
        listed = {alarm.name for alarm in standing}
        known = {one.name for one in self._alarms.values() if one.state != "normal"}
        missing = known - listed - {STRUCTURE_DAMAGE}
        ended = missing & self._missing
        for name in ended:
            self._alarms[name] = replace(self._alarms[name], state="normal")
        self._missing = missing - ended

    def shelve(self, shelved: list[ShelvedAlarm]) -> None:
        """Take the list of shelved alarms, which stand nowhere else."""
        self._shelf = shelved

    def shelf(self) -> list[dict[str, Any]]:
        """The shelved alarms, the one whose time ends first at the beginning."""
        return [asdict(one) for one in self._shelf]

    def alarm(self, name: str) -> Alarm | None:
        """An alarm by name."""
        return self._alarms.get(name)

    def take(self, message: object, now: float) -> None:
        """Take a message that arrived at `now`, a monotonic time [s]."""
        if isinstance(message, SampleBlock | EstimateBlock):
            self._keep(message, now)
        elif isinstance(message, Alarm):
            remember(self._alarms, message)
        elif isinstance(message, Health) and is_remembered(self._health, message.source):
            self._health[message.source] = message, now

    def _keep(self, block: SampleBlock | EstimateBlock, now: float) -> None:
        if isinstance(block, EstimateBlock) and is_of_structure(block):
            return
        kind = "samples" if isinstance(block, SampleBlock) else "estimates"
        self._heard[kind] = now
        columns = columns_of(block)
        if kind == "estimates" and len(block):
            named = {column.name: column for column in columns}
            flags = [name for name in ("armed", "observable") if name in named]
            self._figures = {name: float(named[name].values[-1]) for name in flags}
        shown = [c for c in columns if kind == "samples" or c.name in SHOWN_ESTIMATES]
        self._units |= {column.name: column.unit for column in shown}
        taken = slice(-block.seq % self._every, None, self._every)
        times = np.asarray(block.t_ns[taken] / 1e9)
        if not len(times):
            return
        self._count += 1
        parts = self._parts[kind]
        values = {c.name: np.asarray(c.values[taken], float) for c in shown}
        parts.append((self._count, (times, values)))
        while parts and times[-1] - parts[0][1][0][-1] > SECONDS:
            parts.popleft()

    def signals(self, since: int) -> tuple[int, dict[str, Any]]:
        """The newest part's number, and the signals of all parts after the part `since`."""
        found = {
            kind: _joined([lines for number, lines in parts if number > since])
            for kind, parts in self._parts.items()
        }
        return self._count, {"signals": found, "units": dict(self._units), "seconds": SECONDS}

    def alarms(self) -> list[dict[str, Any]]:
        """All alarms, standing ones first."""
        found = [json_fields(alarm) for alarm in self._alarms.values()]
        return sorted(found, key=lambda a: (a["state"] == "normal", -a["t_ns"]))

    def states(self, now: float, learns: float) -> dict[str, Any]:
        """Whether the monitor watches, why not, and what the processes say.

        Args:
            now: monotonic time [s].
            learns: time that the monitor needs after a start [s].
        """
        processes = [
            {
                "name": source.partition("/")[0],
                "state": "silent" if now - at > SILENT else health.state,
                "text": health.text if now - at <= SILENT else "says nothing",
            }
            for source, (health, at) in sorted(self._health.items())
        ]
        return {"armed": self._armed(now), "why": self._why(now, learns), "processes": processes}

    def hears(self, now: float) -> bool:
        """Whether samples arrive."""
        return now - self._heard.get("samples", -math.inf) < self._silent

    def _armed(self, now: float) -> bool:
        recent = now - self._heard.get("estimates", -math.inf) < self._silent
        return recent and bool(self._figures.get("armed", 0.0))

    def _why(self, now: float, learns: float) -> str:
        """Why the monitor does not watch; empty if it does."""
        if not self.hears(now):
            return "no samples arrive: the rig or its acquisition is stopped"
        monitors = (own for source, own in self._health.items() if source.startswith("monitor"))
        told = [health.text for health, at in monitors if now - at <= SILENT]
        if any(told):
            return "; ".join(filter(None, told))
        if now - self._heard.get("estimates", -math.inf) >= self._silent:
            return "no monitor runs: start `rigwatch monitor` or `rigwatch up`"
        if self._armed(now):
            return (
                ""
                if self._figures.get("observable", 1.0)
                else "the rig hardly moves: friction cannot be observed"
            )
        return (
            "it learns the healthy reference of this run, which takes about"
            f" {learns:.0f} s of steady drive after a start or a gap"
        )


def _joined(parts: list[Lines]) -> dict[str, Any]:
    names = parts[-1][1] if parts else {}
    same = [(times, columns) for times, columns in parts if columns.keys() == names.keys()]
    times = np.concatenate([t for t, _ in same]) if same else np.zeros(0)
    lines = {name: np.concatenate([columns[name] for _, columns in same]) for name in names}
    return {
        "times": [round(at, 4) for at in times.tolist()],
        "lines": {name: _finite(values) for name, values in lines.items()},
    }


def _finite(values: FloatArray) -> list[float | None]:
    return [float(f"{v:.6g}") if math.isfinite(v) else None for v in values.tolist()]

"""Counters of the processes as plots, and the time that samples take to this screen."""

from collections.abc import Iterator
from dataclasses import dataclass

from rigwatch.dashboard.entities import HEALTH
from rigwatch.wire.messages import Health

_FORGET = 0.002
"""Share of each new latency in the mean: about two seconds at one message a sample."""


def counters(health: Health) -> Iterator[tuple[list[object], float]]:
    """Entity and value of each counter; rates, times and counts go to views of their own."""
    for name, value in health.counters.items():
        yield [HEALTH, _kind(name), f"{health.source} {name}"], float(value)


def _kind(name: str) -> str:
    unit = name.rpartition("_")[2]
    return {"hz": "rates", "ms": "latency", "us": "latency"}.get(unit, "counts")


@dataclass(slots=True)
class Latency:
    """From the sample's time stamp to its arrival here: now, mean and worst [ms]."""

    now: float = 0.0
    mean: float = 0.0
    worst: float = 0.0
    seen: bool = False

    def add(self, latency_ns: int) -> None:
        """Take one sample's latency [ns]."""
        self.now = latency_ns / 1e6
        self.mean = self.now if not self.seen else self.mean + _FORGET * (self.now - self.mean)
        self.worst = max(self.worst, self.now)
        self.seen = True

    def figures(self) -> tuple[float, float, float] | None:
        """Now, mean, worst; None before the first."""
        return (self.now, self.mean, self.worst) if self.seen else None

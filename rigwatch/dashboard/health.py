"""Counters of the processes as plots; rates, times and counts go to views of their own."""

from collections.abc import Iterator

from rigwatch.dashboard.entities import HEALTH
from rigwatch.wire.messages import Health

_VIEWS = {"hz": "rates", "ms": "latency", "us": "latency"}


def counters(health: Health) -> Iterator[tuple[list[object], float]]:
    """Entity and value of each counter."""
    for name, value in health.counters.items():
        view = _VIEWS.get(name.rpartition("_")[2], "counts")
        yield [HEALTH, view, f"{health.source} {name}"], float(value)

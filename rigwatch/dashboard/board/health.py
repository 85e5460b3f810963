"""Counters of the processes as plots; different units and meanings have separate views."""

from collections.abc import Iterator

from rigwatch.dashboard.board.entities import HEALTH
from rigwatch.wire.messages import Health

_VIEWS = {"hz": "rates", "ms": "times", "ppm": "clock"}
_TROUBLE = (
    "lost", "error", "skipped", "dropped", "rejected", "reconnect", "restart", "resync",
    "duplicate", "foreign", "recovered", "jump", "flagged", "trouble",
)  # fmt: skip


def counters(health: Health) -> Iterator[tuple[str, str, float]]:
    """View, name and value of each counter."""
    for name, value in health.counters.items():
        yield view_of(name), f"{health.source} {name}", float(value)


def view_of(name: str) -> str:
    """The view, one of `entities.HEALTH_VIEWS`, in which a counter is drawn."""
    unit = name.rpartition("_")[2]
    trouble = any(word in name for word in _TROUBLE)
    return _VIEWS.get(unit, "losses" if trouble else "volumes")


def entity(view: str, name: str) -> list[object]:
    """Where a counter is drawn."""
    return [HEALTH, view, name]

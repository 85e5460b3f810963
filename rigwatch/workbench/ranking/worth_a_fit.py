"""Which effects are worth a fit: the best of each class that the residual looks like."""

from collections.abc import Sequence

from rigwatch.workbench.ranking.ranked import Ranked

LEVEL = 0.01
"""Corrected p-value below which an effect is worth a fit."""
MOST_FITS = {"static": 24, "dynamic": 6}


def worth_a_fit(rows: Sequence[Ranked], kind: str) -> list[Ranked]:
    """The best, and the best of each kind of port, that the residual looks like beyond chance."""
    likely = [row for row in rows if row.p_value < LEVEL]
    told: dict[str, Ranked] = {}
    for row in likely:
        double = _told_by(row, told, likely)
        if double is None:
            told[row.label] = row
            row.reason = "explains less than others; not fitted"
        else:
            row.told_by, row.reason = double, f"looks like {double}; not fitted"
    chosen = list(told.values())[: MOST_FITS[kind]]
    for port_kind in ("force", "actuator", "sensor"):
        first = next((row for row in told.values() if row.kind == port_kind), None)
        if first is not None and first not in chosen:
            chosen.append(first)
    return chosen


def _told_by(row: Ranked, told: dict[str, Ranked], likely: Sequence[Ranked]) -> str | None:
    """What is fitted in the row's place: a double of no more parameters, or of lower order."""
    lower = f"{row.placement.effect.refines}@{row.port}"
    if lower in row.alike and any(other.label == lower for other in likely):
        return lower
    return next((c for c in row.alike if c in told and told[c].free <= row.free), None)

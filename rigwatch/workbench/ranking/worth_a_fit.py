"""Selects the effects to fit: the best of each class that matches the residual."""

from collections.abc import Sequence

from rigwatch.workbench.ranking.ranked import Ranked

LEVEL = 0.01
"""Corrected p-value below which an effect is fitted."""
MOST_FITS = {"static": 24, "dynamic": 6}


def worth_a_fit(rows: Sequence[Ranked], kind: str) -> list[Ranked]:
    """The best significant effects, including the best of each kind of port."""
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
    """Label of the similar effect fitted instead: of lower order, or with no more parameters."""
    lower = f"{row.placement.effect.refines}@{row.port}"
    if lower in row.alike and any(other.label == lower for other in likely):
        return lower
    return next((c for c in row.alike if c in told and told[c].free <= row.free), None)

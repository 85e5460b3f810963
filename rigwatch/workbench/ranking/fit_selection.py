"""Selects the effects to fit: the best of each class that matches the residual."""

from collections.abc import Sequence

from rigwatch.workbench.ranking.ranked import Ranked

LEVEL = 0.01
"""p-value below which an effect is fitted."""
MOST_FITS = {"static": 24, "dynamic": 6}
MUCH = 0.25
"""Share of the residual's energy that an effect must explain, to first order, to be fitted although
it is not significant."""


def select_for_fit(
    rows: Sequence[Ranked], kind: str, *, at_floor: bool, far: bool = False
) -> list[Ranked]:
    """The best likely effects, including the best of each kind of port; marks all that are likely.

    Args:
        rows: best first.
        kind: of the model, a key of `MOST_FITS`.
        at_floor: whether the model leaves only noise. If it leaves more, something is missing, and
            each effect counts that is significant by itself, without the correction for the number
            of candidates: slow residuals have few degrees of freedom, and held-out data decide.
        far: whether the model leaves so much more than noise that these decide alone where no
            effect is significant. The slowest residuals, as of a heated block, are then one swing
            in a window, which noise of any colour might be, and which one effect explains by half.
    """
    likely = [row for row in rows if (row.p_value if at_floor else row.p_alone) < LEVEL]
    if far and not likely:
        likely = [row for row in rows if row.explained > MUCH]
    for row in likely:
        row.likely = True
    kept_rows: dict[str, Ranked] = {}
    for row in likely:
        similar = _fitted_instead(row, kept_rows, likely)
        reason = "explains less than others; not fitted"
        if similar is None:
            kept_rows[row.label] = row
        else:
            row.fitted_instead, reason = similar, f"looks like {similar}; not fitted"
        if row.fitted is None:
            row.reason = reason
    chosen = list(kept_rows.values())[: MOST_FITS[kind]]
    for port_kind in ("force", "actuator", "sensor"):
        first = next((row for row in kept_rows.values() if row.kind == port_kind), None)
        if first is not None and first not in chosen:
            chosen.append(first)
    return chosen


def _fitted_instead(
    row: Ranked, kept_rows: dict[str, Ranked], likely: Sequence[Ranked]
) -> str | None:
    """Label of the similar effect fitted instead: of lower order, or with no more parameters."""
    lower = f"{row.placement.effect.refines}@{row.port}"
    if lower in row.alike and any(other.label == lower for other in likely):
        return lower
    return next((c for c in row.alike if c in kept_rows and kept_rows[c].free <= row.free), None)

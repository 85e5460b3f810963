"""The noise floor from the residual of an effect's fit, where it is lower than the base model's.

Missing physics may fill all bands of the base model's residual, as friction that reverses does, so
that even the quietest is far above the noise. An effect that reaches such a floor would count as
all there is.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.ranking import Ranked, own_floor


def with_lower_floor(bench: Bench, rows: Sequence[Ranked]) -> Bench:
    """The bench with the noise floor of the best accepted effect's fit, if that is lower.

    Args:
        bench: the study; a floor from a healthy recording or from repeated periods stays.
        rows: the ranking, fitted.
    """
    accepted = [row for row in rows if row.accepted and row.fitted is not None]
    if not accepted:
        return bench
    best = min(accepted, key=lambda row: row.held_out_error)
    return replace(bench, floor=own_floor(bench.study, bench.data, bench.floor, best))

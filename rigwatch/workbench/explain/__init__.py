"""Which effect is missing, with a calibrated verdict.

compare ──▶ rank ──▶ pairs ──▶ verdict (calibrated) ──▶ next experiment, where undetermined
"""

from rigwatch.workbench.explain.explain import (
    Explanation,
    Row,
    as_data,
    explain,
    explanation,
    ranking,
)
from rigwatch.workbench.explain.verdict import MUCH_WORSE, Verdict, judge

__all__ = [
    "MUCH_WORSE",
    "Explanation",
    "Row",
    "Verdict",
    "as_data",
    "explain",
    "explanation",
    "judge",
    "ranking",
]

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
from rigwatch.workbench.explain.set_gain import SetGain, set_gain
from rigwatch.workbench.explain.verdict import Verdict, judge

__all__ = [
    "Explanation",
    "Row",
    "SetGain",
    "Verdict",
    "as_data",
    "explain",
    "explanation",
    "judge",
    "ranking",
    "set_gain",
]

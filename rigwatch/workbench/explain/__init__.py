"""Which effect is missing, with a calibrated verdict.

compare ──▶ rank ──▶ pairs ──▶ verdict (calibrated) ──▶ next experiment, where undetermined
"""

from rigwatch.workbench.explain.credibility import still_holds
from rigwatch.workbench.explain.explain import (
    Explained,
    explain,
    explained,
    ranking,
    with_whole_library,
)
from rigwatch.workbench.explain.explanation import Explanation, Row, as_data, explanation
from rigwatch.workbench.explain.sets.rarer_rivals import tries_rarer
from rigwatch.workbench.explain.sets.set_gain import SetGain, set_gain
from rigwatch.workbench.explain.verdict import Verdict, judge

__all__ = [
    "Explained",
    "Explanation",
    "Row",
    "SetGain",
    "Verdict",
    "as_data",
    "explain",
    "explained",
    "explanation",
    "judge",
    "ranking",
    "set_gain",
    "still_holds",
    "tries_rarer",
    "with_whole_library",
]

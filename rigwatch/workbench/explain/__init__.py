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

__all__ = ["Explanation", "Row", "as_data", "explain", "explanation", "ranking"]

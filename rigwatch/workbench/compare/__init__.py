"""Compares model and measurements: errors against the noise floor, and where they occur."""

from rigwatch.workbench.compare.base_fit import Base
from rigwatch.workbench.compare.base_search import Bases, find_base
from rigwatch.workbench.compare.base_step import AT_NOISE
from rigwatch.workbench.compare.compare import Comparison, compare, comparison
from rigwatch.workbench.compare.decided_hold import (
    Decided,
    with_hold_decided,
)
from rigwatch.workbench.compare.horizon import with_horizon_of
from rigwatch.workbench.compare.location import (
    Region,
    locate,
    motion,
    recording_name,
    sample_numbers,
)
from rigwatch.workbench.compare.preparation import (
    Bench,
    bench_of,
    determined_by_healthy,
    open_bench,
    prepared,
    with_base,
)
from rigwatch.workbench.compare.uncertainty_budget import added_variances, apparent_strength
from rigwatch.workbench.compare.unweighed import unweighed
from rigwatch.workbench.compare.warm import Warm

__all__ = [
    "AT_NOISE",
    "Base",
    "Bases",
    "Bench",
    "Comparison",
    "Decided",
    "Region",
    "Warm",
    "added_variances",
    "apparent_strength",
    "bench_of",
    "compare",
    "comparison",
    "determined_by_healthy",
    "find_base",
    "locate",
    "motion",
    "open_bench",
    "prepared",
    "recording_name",
    "sample_numbers",
    "unweighed",
    "with_base",
    "with_hold_decided",
    "with_horizon_of",
]

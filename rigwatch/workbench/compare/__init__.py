"""Compares model and measurements: errors against the noise floor, and where they occur."""

from rigwatch.workbench.compare.bases import AT_NOISE, Base, Bases, find_base
from rigwatch.workbench.compare.beside_healthy import may_share
from rigwatch.workbench.compare.compare import Comparison, compare, comparison
from rigwatch.workbench.compare.decided_hold import (
    Decided,
    with_hold_decided,
    with_hold_of,
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
from rigwatch.workbench.compare.shared_fit import (
    fitted_beside_healthy,
    refuse_what_spoils,
    shared_bench,
    spoils_healthy,
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
    "fitted_beside_healthy",
    "locate",
    "may_share",
    "motion",
    "open_bench",
    "prepared",
    "recording_name",
    "refuse_what_spoils",
    "sample_numbers",
    "shared_bench",
    "spoils_healthy",
    "unweighed",
    "with_base",
    "with_hold_decided",
    "with_hold_of",
    "with_horizon_of",
]

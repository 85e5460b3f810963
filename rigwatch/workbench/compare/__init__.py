"""The model beside the measurements: errors against the noise floor, and where they arise."""

from rigwatch.workbench.compare.compare import (
    Bench,
    Comparison,
    bench_of,
    compare,
    comparison,
    open_bench,
    prepared,
)
from rigwatch.workbench.compare.locate import Region, locate, motion, sample_numbers
from rigwatch.workbench.compare.uncertainty_budget import apparent_strength, beyond

__all__ = [
    "Bench",
    "Comparison",
    "Region",
    "apparent_strength",
    "bench_of",
    "beyond",
    "compare",
    "comparison",
    "locate",
    "motion",
    "open_bench",
    "prepared",
    "sample_numbers",
]

"""Where a model fails: regions of its residual, and in which recording they lie."""

from rigwatch.workbench.compare.location.recording_time import recording_name
from rigwatch.workbench.compare.location.regions import Region, locate, motion, sample_numbers

__all__ = [
    "Region",
    "locate",
    "motion",
    "recording_name",
    "sample_numbers",
]

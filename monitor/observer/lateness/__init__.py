"""How late the inputs act behind where commissioning saw them: learnt from the residual, told from
faults that look alike, and taken away.
"""

from monitor.observer.lateness.constant_lateness import is_constant, rubs_beside
from monitor.observer.lateness.input_lateness import (
    compare_motion,
    follow_lateness,
    lateness_changes,
    rubs,
    seems_late,
    seems_to_grow,
    slides,
    told_lateness,
)
from monitor.observer.lateness.late_response import response_to, unsure_lateness
from monitor.observer.lateness.lateness_state import TAU, forget_lateness, is_late, no_lateness

__all__ = [
    "TAU",
    "compare_motion",
    "follow_lateness",
    "forget_lateness",
    "is_constant",
    "is_late",
    "lateness_changes",
    "no_lateness",
    "response_to",
    "rubs",
    "rubs_beside",
    "seems_late",
    "seems_to_grow",
    "slides",
    "told_lateness",
    "unsure_lateness",
]

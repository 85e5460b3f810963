"""The healthy residual: averaged for periodic drives, bounded for aperiodic ones."""

from monitor.reference.aperiodic import follow_level
from monitor.reference.averages import get_to_know, is_known
from monitor.reference.learning import (
    learnt_here,
    observe,
    pass_over,
    place_in_period,
    refine,
    restart,
)
from monitor.reference.reference_state import (
    APERIODIC,
    ARMED,
    FIXED,
    Reference,
    ReferenceRules,
    new_record,
    new_reference,
)
from monitor.reference.usual import usual

__all__ = [
    "APERIODIC",
    "ARMED",
    "FIXED",
    "Reference",
    "ReferenceRules",
    "follow_level",
    "get_to_know",
    "is_known",
    "learnt_here",
    "new_record",
    "new_reference",
    "observe",
    "pass_over",
    "place_in_period",
    "refine",
    "restart",
    "usual",
]

"""The healthy residual: averaged for periodic drives, bounded for aperiodic ones."""

from monitor.reference.aperiodic import follow_level
from monitor.reference.learning import learnt_here, observe, place_in_period, refine, restart
from monitor.reference.reference_state import (
    APERIODIC,
    ARMED,
    FIXED,
    Reference,
    ReferenceRules,
    new_record,
    new_reference,
)

__all__ = [
    "APERIODIC",
    "ARMED",
    "FIXED",
    "Reference",
    "ReferenceRules",
    "follow_level",
    "learnt_here",
    "new_record",
    "new_reference",
    "observe",
    "place_in_period",
    "refine",
    "restart",
]

"""The observer scheme: fitted equations run along the measured motion, whatever drives it.

    samples ─▶ motion ─▶ prediction ─▶ residual ─▶ decision ─▶ estimates, conditions
               (lag)     (equations)   (remainder,  (range, window,
                                        high-pass)   episode, verdict)

A model of equations is driven by what the sensors show, so that its hidden states need no initial
values and its residual is the missing force at every sample: no period, no phase, and no recording
of a known fault. `sections` is its part of the model file, `commission` makes it from healthy
recordings.
"""

from monitor.observer.choice import commission_best
from monitor.observer.pipeline import ObserverMonitor
from monitor.observer.sections import (
    EquationsPlant,
    HealthyLimits,
    RangeSection,
    RemainderSection,
    SchemeSection,
)

__all__ = [
    "EquationsPlant",
    "HealthyLimits",
    "ObserverMonitor",
    "RangeSection",
    "RemainderSection",
    "SchemeSection",
    "commission_best",
]

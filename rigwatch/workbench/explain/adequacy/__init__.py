"""Whether the model is fit to judge effects, and what to look at if it is not.

adequate.py      the model on a healthy recording, other bases, outliers
ends_of_range.py readings at the end of a sensor's range
excitation.py    parameters that the training recordings do not excite
failing_fit.py   where a model fails whose fit did not converge
reversed_port.py a force port of the wrong sign
sign.py          a channel that is counted the other way
"""

from rigwatch.workbench.explain.adequacy.adequate import (
    SHORT,
    closer_base,
    inadequate,
    stopped_by_outliers,
    uncalibrated,
    unchecked,
    with_adequate_base,
    with_base_offered,
    with_change_told,
)
from rigwatch.workbench.explain.adequacy.ends_of_range import ends_of_range
from rigwatch.workbench.explain.adequacy.excitation import (
    cannot_tell,
    unexcited,
    with_unjudged_told,
)
from rigwatch.workbench.explain.adequacy.failing_fit import with_failure_told
from rigwatch.workbench.explain.adequacy.reversed_port import with_reversed_port
from rigwatch.workbench.explain.adequacy.sign import reversed_channel

__all__ = [
    "SHORT",
    "cannot_tell",
    "closer_base",
    "ends_of_range",
    "inadequate",
    "reversed_channel",
    "stopped_by_outliers",
    "uncalibrated",
    "unchecked",
    "unexcited",
    "with_adequate_base",
    "with_base_offered",
    "with_change_told",
    "with_failure_told",
    "with_reversed_port",
    "with_unjudged_told",
]

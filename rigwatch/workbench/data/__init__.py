"""A study's measured data: signals on one time grid, their scales, and the noise floor."""

from rigwatch.workbench.data.columns import Columns, bridged, copies
from rigwatch.workbench.data.healthy_elements import with_elements
from rigwatch.workbench.data.motion import along_motion
from rigwatch.workbench.data.next_rows import with_next_rows
from rigwatch.workbench.data.noise import (
    METHODS,
    NoiseFloor,
    expected_error,
    find_period,
    from_residual,
    held_out_floor,
    lowered,
    overstated,
    quiet_scale,
    scale_of_several,
)
from rigwatch.workbench.data.one_rate import ALIKE as RATES_ALIKE
from rigwatch.workbench.data.one_rate import RESAMPLED
from rigwatch.workbench.data.prediction import (
    form_along_motion,
    learns_from_healthy,
    predicts_along_motion,
)
from rigwatch.workbench.data.proposals import (
    Part,
    proposed_low_pass,
    proposed_split,
    unchanging,
)
from rigwatch.workbench.data.recorded_columns import read_columns
from rigwatch.workbench.data.repeats import repeat_along_motion, repeat_of
from rigwatch.workbench.data.scales import port_sizes, simulated_states
from rigwatch.workbench.data.signals import UNFILLED, Data, MotionSensor, parameters_of, prepare

__all__ = [
    "METHODS",
    "RATES_ALIKE",
    "RESAMPLED",
    "UNFILLED",
    "Columns",
    "Data",
    "MotionSensor",
    "NoiseFloor",
    "Part",
    "along_motion",
    "bridged",
    "copies",
    "expected_error",
    "find_period",
    "form_along_motion",
    "from_residual",
    "held_out_floor",
    "learns_from_healthy",
    "lowered",
    "overstated",
    "parameters_of",
    "port_sizes",
    "predicts_along_motion",
    "prepare",
    "proposed_low_pass",
    "proposed_split",
    "quiet_scale",
    "read_columns",
    "repeat_along_motion",
    "repeat_of",
    "scale_of_several",
    "simulated_states",
    "unchanging",
    "with_elements",
    "with_next_rows",
]

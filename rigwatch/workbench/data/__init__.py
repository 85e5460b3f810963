"""What a study measures: signals on one grid, their scales, and the noise floor."""

from rigwatch.workbench.data.motion import along_motion, goes_along_motion
from rigwatch.workbench.data.noise_floor import (
    METHODS,
    NoiseFloor,
    find_period,
    from_residual,
    quiet_scale,
)
from rigwatch.workbench.data.signal_scales import port_sizes
from rigwatch.workbench.data.signals import Data, MotionSensor, parameters_of, prepare

__all__ = [
    "METHODS",
    "Data",
    "MotionSensor",
    "NoiseFloor",
    "along_motion",
    "find_period",
    "from_residual",
    "goes_along_motion",
    "parameters_of",
    "port_sizes",
    "prepare",
    "quiet_scale",
]

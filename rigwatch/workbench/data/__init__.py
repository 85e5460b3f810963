"""What a study measures: signals on one grid, their scales, and the noise floor."""

from rigwatch.workbench.data.noise_floor import (
    METHODS,
    NoiseFloor,
    find_period,
    from_residual,
    quiet_scale,
)
from rigwatch.workbench.data.signal_scales import port_sizes
from rigwatch.workbench.data.signals import Data, parameters_of, prepare

__all__ = [
    "METHODS",
    "Data",
    "NoiseFloor",
    "find_period",
    "from_residual",
    "parameters_of",
    "port_sizes",
    "prepare",
    "quiet_scale",
]

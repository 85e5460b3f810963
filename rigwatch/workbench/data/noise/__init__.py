"""What is left of an error that no effect has to explain: noise, and the model's own error."""

from rigwatch.workbench.data.noise.error_spectrum import expected_error
from rigwatch.workbench.data.noise.noise_floor import (
    METHODS,
    NoiseFloor,
    find_period,
    from_residual,
    held_out_floor,
    lowered,
    quiet_scale,
    scale_of_several,
)
from rigwatch.workbench.data.noise.stated import overstated

__all__ = [
    "METHODS",
    "NoiseFloor",
    "expected_error",
    "find_period",
    "from_residual",
    "held_out_floor",
    "lowered",
    "overstated",
    "quiet_scale",
    "scale_of_several",
]

"""Turns true values into raw codes: sensor dynamics, faults, noise, ranges and converters.

    true value -> piezo high-pass (acceleration) -> lag -> delay -> gain, bias, drift, noise, spikes
               -> limit of the sensor -> stuck -> resolution -> volts -> converter's rails -> code

Every step works on one sample at a time, so a run does not depend on its division into calls.
"""

# Fields of a record are known to numba, not to mypy.
# mypy: disable-error-code="no-any-return"

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.kernel import kernel, part

Record = Any
"""One record of a structured array; numba compiles its fields as attributes."""
Floats = NDArray[np.float64]

SENSOR_STATE = ("lagged", "drifted", "held", "high_pass_in", "high_pass_out")
SENSOR_STATE_TYPE = np.dtype([(name, np.float64) for name in SENSOR_STATE])
SENSOR_TRAITS = ("noise", "range", "resolution", "volts_per_si", "volts_per_code", "high_pass")
"""A sensor: SI units, volts, and the corner of its high-pass [Hz], 0 for none."""
SENSOR_TRAITS_TYPE = np.dtype([(name, np.float64) for name in SENSOR_TRAITS])
SENSOR_DELAY_LINE = 128
_SPIKES_PER_SECOND = 2.0


@kernel(error_model="numpy")
def high_passed(value: float, warped: float, s: Record) -> float:
    """First-order high-pass, bilinear, as a piezo element with its charge amplifier has.

    `warped` is tan(pi corner / rate).
    """
    out = (value - s.high_pass_in + (1.0 - warped) * s.high_pass_out) / (1.0 + warped)
    s.high_pass_in, s.high_pass_out = value, out
    return out


@part(error_model="numpy")
def delayed(value: float, line: Floats, sample: int, late: float) -> float:
    """`value` delayed by `late` samples, interpolated linearly."""
    line[sample % SENSOR_DELAY_LINE] = value
    late = min(late, SENSOR_DELAY_LINE - 2.0)
    whole = int(late)
    part = late - whole
    value = (1.0 - part) * line[(sample - whole) % SENSOR_DELAY_LINE]
    return value + part * line[(sample - whole - 1) % SENSOR_DELAY_LINE]


@part(error_model="numpy")
def reading(  # noqa: PLR0917
    value: float,
    noise: float,
    uniform: float,
    traits: Record,
    f: Record,
    s: Record,
    rate: float,
) -> float:
    """The sensor's reading in SI units, faults included."""
    s.drifted = s.drifted + f.drift / rate if f.drift != 0.0 else 0.0
    value = f.gain * value + f.bias + s.drifted
    value += noise
    if f.spikes != 0.0 and uniform < _SPIKES_PER_SECOND / rate:
        value += f.spikes if uniform < 0.5 * _SPIKES_PER_SECOND / rate else -f.spikes
    limit = traits.range if f.saturation <= 0.0 else min(traits.range, f.saturation)
    value = min(max(value, -limit), limit)
    if f.stuck >= 0.5:
        value = s.held
    s.held = value
    if traits.resolution > 0.0:
        value = round(value / traits.resolution) * traits.resolution
    return value


@kernel(error_model="numpy")
def advance_sensors(  # noqa: PLR0917
    true_values: Floats,
    normal: Floats,
    uniform: Floats,
    traits: NDArray[np.void],
    faults: NDArray[np.void],
    state: NDArray[np.void],
    lines: Floats,
    first: int,
    rate: float,
    codes: NDArray[np.int16],
) -> None:
    """Writes the codes of `true_values` (samples x 3 channels) into `codes` (int16, same shape).

    `normal` and `uniform` are random numbers of the same shape; `first` is the number of the
    first sample.
    """
    for channel in range(3):
        t: Record = traits[channel]
        f: Record = faults[channel]
        s: Record = state[channel]
        share = 1.0 - math.exp(-1.0 / (f.lag * rate)) if f.lag > 0.0 else 1.0
        warped = math.tan(math.pi * t.high_pass / rate)
        noise = math.hypot(t.noise, f.noise)
        codes_per_si = t.volts_per_si / t.volts_per_code
        for row in range(true_values.shape[0]):
            value = true_values[row, channel]
            if t.high_pass > 0.0:
                value = high_passed(value, warped, s)
            s.lagged += share * (value - s.lagged)
            value = delayed(s.lagged, lines[channel], first + row, f.delay * rate)
            value = reading(
                value, noise * normal[row, channel], uniform[row, channel], t, f, s, rate
            )
            code = round(value * codes_per_si)
            codes[row, channel] = min(max(code, -32768), 32767)

"""Turns raw codes into calibrated samples with quality flags, sample by sample.

    saturated    at a converter rail for three samples in a row, or outside the sensor's range
    stuck        constant code for `stuck_after` samples, as the channel's own do not repeat, while
                 every other channel moves
    spike        further from the last good sample than the sensor can move
    non-finite   NaN or infinite; replaced by the last good value

A decision about a sample depends on it and the samples before it, never on the cut into blocks. A
channel "moves" when its code changes by at least a thousandth of the converter's range within the
same time. All others must move, so that a mass held by friction is not mistaken for a dead sensor;
a single channel is never stuck.

A controller's set value has no noise, and may be held for seconds. So a run of equal codes must
also be improbable for a channel whose codes repeat as often as this one's have lately. As long as
that is not known, the run must be three times as long.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from daq.adapter import RawBlock
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.device import Calibration
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import ByteArray, Column, SampleBlock
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.rig_config import ChannelSection

_MOVES = 1e-3
_RAIL_RUN = 3
_SPIKE_RUN = 5
_IMPROBABLE = 1e-9
_UNKNOWN = 3
"""Factor on `stuck_after` for a channel whose codes are not known yet."""
_REMEMBERED = 8192
"""Samples after which older codes count half."""
_STATE = np.dtype(
    [
        ("good", np.float64),
        ("has_good", np.bool_),
        ("since_good", np.int64),
        ("code", np.float64),
        ("equal", np.int64),
        ("repeats", np.float64),
        ("steps", np.float64),
        ("reference", np.float64),
        ("since_move", np.int64),
        ("rail", np.int64),
    ]
)


class States(NamedTuple):
    """What `calibrate` needs of a conditioner; the last field is written to."""

    gain: FloatArray
    offset: FloatArray
    limits: FloatArray
    stuck_after: IntArray
    channels: NDArray[Any]


class Conditioner:
    """Calibrates and flags the samples of one device.

    Args:
        channels: the device's channels, in the order of its codes.
        device: the device's name in messages.

    Attributes:
        states: of the boot whose samples came last, for `calibrate`.
    """

    def __init__(self, channels: Sequence[ChannelSection], device: str = "rig") -> None:
        self._channels = tuple(channels)
        self._device = device
        self._calibration = c = Calibration.of(channels)
        self._stuck_after = np.array([channel.stuck_after for channel in channels], np.int64)
        steps = [np.inf if c.spike_above is None else c.spike_above for c in channels]
        self._limits = np.stack([c.code_low, c.code_high, c.low, c.high, steps])
        self._boot: int | None = None
        self._state = np.zeros(len(self._channels), _STATE)
        self.states = States(
            self._calibration.gain,
            self._calibration.offset,
            self._limits,
            self._stuck_after,
            self._state,
        )
        self._compile()

    def condition(self, raw: RawBlock, t_ns: IntArray) -> SampleBlock:
        """The calibrated block of `raw`, which holds consecutive samples, unwrapped, of one boot.

        Args:
            raw: n samples.
            t_ns: shape (n,), Unix time of each [ns].
        """
        if raw.boot != self._boot:
            self._boot = raw.boot
            self._state[:] = np.zeros(1, _STATE)
            self._state["since_move"] = np.iinfo(np.int64).max // 2
        # A copy for all channels, as one for each costs more.
        values, flags = (one.T.copy() for one in self._judged(raw))
        columns = tuple(
            [
                Column(channel.name, channel.unit, *of)
                for channel, *of in zip(self._channels, values, flags, strict=True)
            ]
        )
        return SampleBlock(self._device, raw.boot, int(raw.seq[0]), raw.device_us, t_ns, columns)

    def _compile(self) -> None:
        """Compile the kernels before the first sample arrives."""
        none = np.zeros((0, len(self._channels)))
        for calibrated in (False, True):
            no_numbers = np.zeros(0, np.int64)
            self._judged(RawBlock(0, no_numbers, no_numbers, none, no_numbers, calibrated))

    def _judged(self, raw: RawBlock) -> tuple[FloatArray, ByteArray]:
        codes = np.ascontiguousarray(raw.codes, np.float64)
        if raw.calibrated:
            values = codes.copy()
            flags = raw.quality.copy() if len(raw.quality) else np.zeros(codes.shape, np.uint8)
            _hold_last(values, flags, self._state)
        else:
            values, flags = np.empty(codes.shape), np.empty(codes.shape, np.uint8)
            calibrate(self.states, codes, values, flags)
        return values, flags


@kernel()
def calibrate(states: States, codes: FloatArray, values: FloatArray, flags: ByteArray) -> None:
    """Calibrate and flag samples of the boot that came last.

    Args:
        states: of the conditioner.
        codes: shape (n, channels).
        values, flags: the same shape, filled.
    """
    for i in range(codes.shape[0]):
        for k in range(codes.shape[1]):
            values[i, k] = codes[i, k] * states.gain[k] + states.offset[k]
            flags[i, k] = quality.GOOD
    _judge(codes, values, flags, states.limits, states.stuck_after, states.channels)


@kernel()
def _hold_last(values: FloatArray, flags: ByteArray, state: Any) -> None:
    for i in range(values.shape[0]):
        for k in range(values.shape[1]):
            if np.isfinite(values[i, k]):
                state[k].good = values[i, k]
            else:
                values[i, k] = state[k].good
                flags[i, k] |= quality.NON_FINITE


@kernel()
def _follow(code: float, moves: float, s: Any) -> None:
    """Track how long a channel's code has been constant, and how long it has not moved."""
    if code == s.code:
        s.equal += 1
    else:
        s.repeats += max(s.equal - 1, 0)
        s.steps += s.equal
        if s.steps > _REMEMBERED:
            s.repeats, s.steps = s.repeats / 2, s.steps / 2
        s.equal = 1
    s.code = code
    s.since_move += 1
    if abs(code - s.reference) >= moves:
        s.reference = code
        s.since_move = 0


@part()
def _judge(  # noqa: PLR0917 -- a compiled kernel takes no keywords
    codes: FloatArray,
    values: FloatArray,
    flags: ByteArray,
    limits: FloatArray,
    stuck_after: IntArray,
    state: Any,
) -> None:
    n, channels = codes.shape
    for i in range(n):
        for k in range(channels):
            if np.isfinite(codes[i, k]):
                _follow(codes[i, k], _MOVES * (limits[1, k] - limits[0, k]), state[k])
        for k in range(channels):
            flags[i, k] |= _flags_of(codes[i, k], values[i, k], limits[:, k], state[k])
            if _is_constant(state[k], stuck_after[k]) and _others_move(state, k, stuck_after[k]):
                flags[i, k] |= quality.STUCK
            if flags[i, k] & quality.NON_FINITE:
                values[i, k] = state[k].good


@part()
def _is_constant(s: Any, stuck_after: int) -> bool:
    """Whether the code has been constant for longer than this channel's usually is."""
    if stuck_after == 0 or s.equal < stuck_after:
        return False
    if s.steps < stuck_after:
        return bool(s.equal >= _UNKNOWN * stuck_after)
    return bool(((s.repeats + 1.0) / (s.steps + 2.0)) ** s.equal < _IMPROBABLE)


@part()
def _others_move(state: Any, k: int, within: int) -> bool:
    if len(state) == 1:
        return False
    for j in range(len(state)):  # noqa: SIM110 (no generators in a compiled kernel)
        if j != k and state[j].since_move >= within:
            return False
    return True


@part()
def _flags_of(code: float, value: float, limits: FloatArray, s: Any) -> int:
    s.since_good += 1
    if not np.isfinite(value):
        return quality.NON_FINITE
    at_rail = code <= limits[0] or code >= limits[1]
    s.rail = s.rail + 1 if at_rail else 0
    if s.rail >= _RAIL_RUN or value < limits[2] or value > limits[3]:
        return quality.SATURATED
    step = limits[4] * s.since_good
    if s.has_good and s.since_good <= _SPIKE_RUN and abs(value - s.good) > step:
        return quality.SPIKE
    s.good, s.has_good, s.since_good = value, True, 0
    return quality.GOOD

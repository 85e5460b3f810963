"""A recording for a model along its measured motion.

The motion is smoothed with zero phase, with a width chosen from each channel's noise, and added to
the inputs. Samples do not count (NaN outputs) if the smoothing window is incomplete, as next to
a gap, and while hidden states settle: at the beginning of a recording, and after a hole in what
drives them, through which they have followed an interpolated motion.

If the balance of a state is predicted, it is compared with the rate of the channel. The
differentiating kernel is also a low-pass, which the prediction is not subject to. Both are
therefore filtered with a low-pass well within the kernel's pass band (`Recording.thinning`).
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from rigwatch.physics.engine.equations import (
    Model,
    balanced_states,
    measured_states,
    predicted_outputs,
)
from rigwatch.physics.engine.fit.decimation import Thinning
from rigwatch.physics.engine.fit.recording import Recording, ends_of_holes, filled
from rigwatch.physics.engine.fit.smoothing import best_width, flat_to, smoothed
from rigwatch.physics.transfer import Derivative, SensorPhase, sensor_phase
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError

PASSED = 0.4
"""Pass band of the decimation's low-pass, relative to the decimated rate."""


def motion_recording(
    model: Model,
    recording: Recording,
    *,
    parts: Sequence[int] = (),
    settling: float = 0.0,
    widths: Mapping[str, int] | None = None,
    late: Mapping[str, float] | None = None,
) -> Recording:
    """A recording for `along_measured_motion(model)`, from one for the model itself.

    Args:
        model: the original model, not transformed.
        recording: its inputs and outputs.
        parts: lengths of the concatenated parts; the recording's own if empty.
        settling: time that does not count at the start of each part and after each long hole in
            what drives the model [s].
        widths: of the smoothing, by channel [samples]; chosen from the noise if None.
        late: lateness of channels of the motion [s], see `motion_phases`; none if None.

    Raises:
        ModelError: no channel measures any of the model's states, or one has no valid sample.
    """
    cut = _ends(recording, parts)
    chosen = motion_widths(model, recording, parts) if widths is None else widths
    channels = _channels(model, recording)
    driving = np.column_stack([channels[state.channel] for state in measured_states(model)])
    begins = (0, *cut, *recording.breaks, *ends_of_holes(driving))
    counted = _settled(len(recording), begins, round(settling / recording.dt))
    spacings, motion = _spacings(recording, cut), []
    for state in measured_states(model):
        signal, width = channels[state.channel], chosen[state.channel]
        behind = (late or {}).get(state.channel, 0.0)
        motion.append(_smoothed_parts(signal, spacings, width, state.order, cut, late=behind))
        counted &= _whole_kernel(signal, width, cut)
    inputs = np.column_stack([recording.inputs, *motion])
    outputs = _measured_outputs(model, recording, chosen, cut)
    shown = np.where(counted[:, None], outputs, np.nan)
    lengths = tuple(np.diff([0, *cut, len(recording)]).tolist())
    thinning = _thinning(model, recording, chosen, lengths)
    drives = len(model.inputs)
    begun = tuple(recording.time[[0, *cut]].tolist())
    return Recording(
        recording.dt, inputs, shown, thinning, lengths, drives, recording.passed,
        spacings=recording.spacings and spacings, begun=begun,
        derived=_derived(model, recording),
    )  # fmt: skip


def motion_widths(model: Model, recording: Recording, parts: Sequence[int] = ()) -> dict[str, int]:
    """Smoothing width of each channel for its order of differentiation, by channel [samples].

    Raises:
        ModelError: a channel has no valid sample.
    """
    cut, channels = _ends(recording, parts), _channels(model, recording)
    found: dict[str, int] = {}
    for channel, order in _orders(model).items():
        longest = max(np.split(channels[channel], cut), key=len)
        if not np.isfinite(longest).any():
            raise ModelError(f"{model.name}: found no valid sample of {channel!r}")
        found[channel] = best_width(filled(longest), order)
    return found


def motion_rates(model: Model, recording: Recording) -> FloatArray:
    """Measured rates of the states whose balance an equation is, shape (n, balanced states).

    Args:
        model: the original model, not transformed.
        recording: its inputs and outputs.

    Raises:
        ModelError: a channel has no valid sample.
    """
    cut, channels = _ends(recording, ()), _channels(model, recording)
    found = [np.empty((len(recording), 0))]
    for state in balanced_states(model):
        signal, order = channels[state.channel], state.order + 1
        if not np.isfinite(signal).any():
            raise ModelError(f"{model.name}: found no valid sample of {state.channel!r}")
        longest = max(np.split(signal, cut), key=len)
        width = best_width(filled(longest), order)
        rate = _smoothed_parts(signal, _spacings(recording, cut), width, order, cut)
        whole = _whole_kernel(signal, width, cut)
        found.append(np.where(whole, rate, np.nan)[:, None])
    return np.concatenate(found, axis=1)


def motion_phases(model: Model, recording: Recording) -> dict[str, SensorPhase]:
    """Phase between each channel of the motion and the output that measures its rate.

    Args:
        model: the original model, not transformed.
        recording: of the healthy rig, whose sensors are as they should be.
    """
    cut, channels = _ends(recording, ()), _channels(model, recording)
    outputs = predicted_outputs(model)
    if not outputs or recording.thinning is not None:
        return {}
    other = np.split(channels[model.outputs[outputs[0]].channel or outputs[0]], cut)
    found: dict[str, SensorPhase] = {}
    for state in balanced_states(model):
        own = np.split(channels[state.channel], cut)
        pairs = [(_longest(*pair)) for pair in zip(own, other, strict=True)]
        phase = sensor_phase(pairs, recording.dt, state.order + 1)
        if phase is not None:
            found[state.channel] = phase
    return found


def _longest(own: FloatArray, other: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The longest stretch in which both channels are valid."""
    valid = np.isfinite(own) & np.isfinite(other)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], valid.astype(np.int8), [0]]))).reshape(-1, 2)
    if not ends.size:
        return own[:0], other[:0]
    begin, end = ends[np.argmax(ends[:, 1] - ends[:, 0])]
    return own[begin:end], other[begin:end]


def _orders(model: Model) -> dict[str, int]:
    """Highest order of differentiation of each channel of the motion."""
    more = 0 if predicted_outputs(model) else 1
    balanced = balanced_states(model)
    orders: dict[str, int] = {}
    for state in measured_states(model):
        order = state.order + (more if state in balanced else 0)
        orders[state.channel] = max(order, orders.get(state.channel, 0))
    return orders


def _measured_outputs(
    model: Model, recording: Recording, widths: Mapping[str, int], cut: Sequence[int]
) -> FloatArray:
    """Measurements of the transformed model's outputs, shape (n, outputs)."""
    kept = predicted_outputs(model)
    if kept:
        return recording.outputs[:, [list(model.outputs).index(name) for name in kept]]
    channels = _channels(model, recording)
    spacings = _spacings(recording, cut)
    rates = [
        _smoothed_parts(channels[own.channel], spacings, widths[own.channel], own.order + 1, cut)
        for own in balanced_states(model)
    ]
    return np.stack(rates, axis=1)


def _derived(model: Model, recording: Recording) -> tuple[Derivative | None, ...]:
    """How the outputs of `_measured_outputs` were derived; nothing is told of rates."""
    names = list(model.outputs)
    return tuple(recording.derivatives[names.index(name)] for name in predicted_outputs(model))


def _thinning(
    model: Model, recording: Recording, widths: Mapping[str, int], parts: tuple[int, ...]
) -> Thinning | None:
    """The recording's own decimation or, for balances, one within their kernels' pass band."""
    if recording.thinning is not None or predicted_outputs(model):
        return recording.thinning
    flat = min(flat_to(widths[s.channel], s.order + 1) for s in balanced_states(model))
    return Thinning(max(math.ceil(PASSED / flat), 2), 0, parts)


def _ends(recording: Recording, parts: Sequence[int]) -> list[int]:
    """Where one part of a recording ends and the next begins."""
    return [int(end) for end in np.cumsum(parts or recording.parts)[:-1]]


def _spacings(recording: Recording, cut: Sequence[int]) -> tuple[float, ...]:
    """Time between samples of each part [s]."""
    return tuple(recording.spacing[[0, *cut]].tolist())


def _channels(model: Model, recording: Recording) -> dict[str, FloatArray]:
    """Measured channels by name, each of shape (n,)."""
    names = (output.channel or name for name, output in model.outputs.items())
    return dict(zip(names, recording.outputs.T, strict=True))


def _smoothed_parts(
    signal: FloatArray,
    spacings: Sequence[float],
    width: int,
    order: int,
    cut: Sequence[int],
    *,
    late: float = 0.0,
) -> FloatArray:
    pieces = [
        smoothed(filled(piece), dt, width, order, late)
        for piece, dt in zip(np.split(signal, cut), spacings, strict=True)
    ]
    return np.concatenate(pieces)


def _whole_kernel(signal: FloatArray, width: int, cut: Sequence[int]) -> BoolArray:
    """Samples with a complete smoothing window, shape (n,)."""
    kernel = np.ones(width)
    there = np.split(np.isfinite(signal).astype(np.float64), cut)
    # Of a part that is shorter than the kernel the convolution is as long as that.
    return np.concatenate([
        np.convolve(piece, kernel, "same") > width - 0.5
        if len(piece) >= width
        else np.zeros(len(piece), np.bool_)
        for piece in there
    ])  # fmt: skip


def _settled(samples: int, begins: Sequence[int], settling: int) -> BoolArray:
    """Samples later than `settling` after each at which hidden states begin, shape (n,)."""
    found = np.ones(samples, np.bool_)
    for begin in begins:
        found[begin : begin + settling] = False
    return found

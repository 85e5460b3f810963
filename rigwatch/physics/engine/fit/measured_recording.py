"""A recording for a model that is driven along its measured motion.

The motion is smoothed without phase, as wide as each channel's noise asks for, and joins the
inputs. Samples are not counted (NaN outputs) where the smoothing has less than its whole width, as
beside a gap, and while hidden states settle.

Where the balance of a state is predicted, the rate of the channel is its measurement. The kernel
that differentiates also low-passes, which the prediction does not see; so both then go through one
low-pass of their own, well inside of what the kernel lets through (`Recording.thinning`).
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
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.smoothing import best_width, flat_to, smoothed
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError

PASSED = 0.4
"""Frequency over the thinned rate up to which the low-pass of thinning lets signals through."""


def motion_recording(
    model: Model,
    recording: Recording,
    *,
    parts: Sequence[int] = (),
    settling: float = 0.0,
    widths: Mapping[str, int] | None = None,
) -> Recording:
    """A recording for `along_measured_motion(model)`, from one for the model itself.

    Args:
        model: as it was written, not transformed.
        recording: its inputs and outputs.
        parts: lengths of what lies one behind the other; the recording's own if empty.
        settling: at the beginning of each part, what is not counted [s].
        widths: of the smoothing, by channel [samples]; as the noise asks for if None.

    Raises:
        ModelError: no channel shows any of the model's states, or one shows nothing valid.
    """
    cut = _ends(recording, parts)
    chosen = motion_widths(model, recording, parts) if widths is None else widths
    channels = _channels(model, recording)
    counted = _settled(len(recording), cut, round(settling / recording.dt))
    motion = []
    for state in measured_states(model):
        signal, width = channels[state.channel], chosen[state.channel]
        motion.append(_smoothed_parts(signal, recording.dt, width, state.order, cut))
        counted &= _whole_kernel(signal, width, cut)
    inputs = np.column_stack([recording.inputs, *motion])
    outputs = _measured_outputs(model, recording, chosen, cut)
    shown = np.where(counted[:, None], outputs, np.nan)
    lengths = tuple(np.diff([0, *cut, len(recording)]).tolist())
    thinning = _thinning(model, recording, chosen, lengths)
    return Recording(recording.dt, inputs, shown, thinning, lengths)


def motion_widths(model: Model, recording: Recording, parts: Sequence[int] = ()) -> dict[str, int]:
    """How wide each channel is smoothed for what is made of it, by channel [samples].

    Raises:
        ModelError: a channel shows nothing valid.
    """
    cut, channels = _ends(recording, parts), _channels(model, recording)
    found: dict[str, int] = {}
    for channel, order in _orders(model).items():
        longest = max(np.split(channels[channel], cut), key=len)
        if not np.isfinite(longest).any():
            raise ModelError(f"{model.name}: found no valid sample of {channel!r}")
        found[channel] = best_width(_bridged(longest), order)
    return found


def _orders(model: Model) -> dict[str, int]:
    """How often each channel of the motion is differentiated at most."""
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
    """What the transformed model's outputs are held against, shape (n, outputs)."""
    kept = predicted_outputs(model)
    if kept:
        return recording.outputs[:, [list(model.outputs).index(name) for name in kept]]
    channels = _channels(model, recording)
    rates = [
        _smoothed_parts(
            channels[state.channel], recording.dt, widths[state.channel], state.order + 1, cut
        )
        for state in balanced_states(model)
    ]
    return np.stack(rates, axis=1)


def _thinning(
    model: Model, recording: Recording, widths: Mapping[str, int], parts: tuple[int, ...]
) -> Thinning | None:
    """The recording's own or, for balances, one within what their kernels let through."""
    if recording.thinning is not None or predicted_outputs(model):
        return recording.thinning
    flat = min(flat_to(widths[s.channel], s.order + 1) for s in balanced_states(model))
    return Thinning(max(math.ceil(PASSED / flat), 2), 0, parts)


def _ends(recording: Recording, parts: Sequence[int]) -> list[int]:
    """Where one part of a recording ends and the next begins."""
    return [int(end) for end in np.cumsum(parts or recording.parts)[:-1]]


def _channels(model: Model, recording: Recording) -> dict[str, FloatArray]:
    """Measured channels by name, each of shape (n,)."""
    names = (output.channel or name for name, output in model.outputs.items())
    return dict(zip(names, recording.outputs.T, strict=True))


def _smoothed_parts(
    signal: FloatArray, dt: float, width: int, order: int, cut: Sequence[int]
) -> FloatArray:
    pieces = [smoothed(_bridged(piece), dt, width, order) for piece in np.split(signal, cut)]
    return np.concatenate(pieces)


def _bridged(signal: FloatArray) -> FloatArray:
    """The signal with straight lines over what is missing; zeros where nothing is there."""
    good = np.isfinite(signal)
    if good.all():
        return signal
    if not good.any():
        return np.zeros_like(signal)
    at = np.arange(len(signal))
    return np.interp(at, at[good], signal[good])


def _whole_kernel(signal: FloatArray, width: int, cut: Sequence[int]) -> BoolArray:
    """Samples about which the kernel finds all that it needs, shape (n,)."""
    kernel = np.ones(width)
    there = np.split(np.isfinite(signal).astype(np.float64), cut)
    return np.concatenate([np.convolve(piece, kernel, "same") > width - 0.5 for piece in there])


def _settled(samples: int, cut: Sequence[int], settling: int) -> BoolArray:
    """Samples that are not within `settling` of the beginning of a part, shape (n,)."""
    found = np.ones(samples, np.bool_)
    for begin in (0, *cut):
        found[begin : begin + settling] = False
    return found

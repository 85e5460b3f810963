"""Recordings, their division into windows, and initial states from the channels."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from rigwatch.physics.engine.compile import elapsed
from rigwatch.physics.engine.equations import Model, System
from rigwatch.physics.engine.fit.decimation import Thinning
from rigwatch.physics.transfer import Derivative
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import ModelError

SAME_SPACING = 1e-6
"""Relative difference of times between samples up to which they are the same."""

LONG_HOLE = 3
"""Samples without a valid input, one after the other, from which hidden states begin anew."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Measured inputs and outputs for one model.

    Attributes:
        dt: time between samples, the mean if it differs from recording to recording [s].
        inputs: in the order of the model's inputs, shape (n, n_u).
        outputs: in the order of its outputs, shape (n, n_y); NaN without a valid sample.
        thinning: filter and decimation of residuals and sensitivities, None without.
        parts: lengths of the concatenated recordings; a single one if empty.
        driving: leading inputs that drive the rig, before those of its measured motion; None if
            all do.
        passed: frequency up to which the outputs keep their noise, over the rate.
        breaks: samples before which inputs are unknown for a while, so that hidden states begin
            anew in the next window.
        spacings: time between the samples of each part if they differ [s]; all `dt` if empty.
        begun: time of the equations at the first sample of each part; 0 if empty [s].
        derived: how each output was derived from a measured channel, None of those that were not;
            none was if empty.
    """

    dt: float
    inputs: FloatArray
    outputs: FloatArray
    thinning: Thinning | None = None
    parts: tuple[int, ...] = ()
    driving: int | None = None
    passed: float = 0.5
    breaks: tuple[int, ...] = ()
    spacings: tuple[float, ...] = ()
    begun: tuple[float, ...] = ()
    derived: tuple[Derivative | None, ...] = ()

    def __len__(self) -> int:
        return len(self.inputs)

    @property
    def derivatives(self) -> tuple[Derivative | None, ...]:
        """How each output was derived, None of those that were measured, shape (outputs,)."""
        return self.derived or (None,) * self.outputs.shape[1]

    @property
    def excitation(self) -> FloatArray:
        """Inputs that drive the rig and change, without their means, shape (n, up to n_u)."""
        drive = self.inputs[:, : self.driving]
        changing = drive[:, np.ptp(drive, axis=0) > 0.0]
        return np.asarray(changing - changing.mean(axis=0), np.float64)

    @property
    def slices(self) -> list[slice]:
        """Samples of each of the concatenated recordings."""
        ends = np.cumsum(self.parts or (len(self),)).tolist()
        return [slice(start, end) for start, end in zip([0, *ends], ends, strict=False)]

    @property
    def own_spacings(self) -> tuple[float, ...]:
        """Time between samples of each of the concatenated recordings [s]."""
        return self.spacings or (self.dt,) * max(len(self.parts), 1)

    @property
    def spacing(self) -> FloatArray:
        """Time from each sample to the next, shape (n,) [s]."""
        return np.repeat(self.own_spacings, self.parts or (len(self),))

    @property
    def begins(self) -> IntArray:
        """First sample of the recording that each belongs to, shape (n,)."""
        first = np.array([part.start for part in self.slices], np.int64)
        return np.repeat(first, self.parts or (len(self),))

    @property
    def times_begun(self) -> tuple[float, ...]:
        """Time of the equations at the first sample of each of the joined recordings [s]."""
        return self.begun or (0.0,) * max(len(self.parts), 1)

    @property
    def time(self) -> FloatArray:
        """Time of the equations at each sample, shape (n,) [s]."""
        begun = np.repeat(self.times_begun, self.parts or (len(self),))
        return begun + elapsed(self.begins, self.spacing)

    def stretch(self, begin: int, end: int) -> "Recording":
        """The samples from `begin` to before `end`; their residuals are not thinned."""
        own = [(max(one.start, begin), min(one.stop, end)) for one in self.slices]
        kept = [(last - first, k) for k, (first, last) in enumerate(own) if last > first]
        lengths, numbers = zip(*kept, strict=True)
        dt, spacings = of_parts([self.own_spacings[k] for k in numbers], lengths)
        after = {k: max(begin - self.slices[k].start, 0) * self.own_spacings[k] for k in numbers}
        return replace(
            self,
            dt=dt,
            inputs=self.inputs[begin:end],
            outputs=self.outputs[begin:end],
            thinning=None,
            parts=lengths,
            breaks=tuple(at - begin for at in self.breaks if begin <= at < end),
            spacings=spacings,
            begun=tuple(self.times_begun[k] + after[k] for k in numbers),
        )


@dataclass(frozen=True, eq=False)
class Windows:
    """Division of a recording into windows.

    Attributes:
        starts: first sample of each window, shape (windows,).
        length: samples in each.
        parts: samples of each recording if windows are recordings; shorter ones are padded.
    """

    starts: IntArray
    length: int
    parts: tuple[int, ...] = ()

    def whole(self, windowed: FloatArray, lengths: Sequence[int] | None = None) -> FloatArray:
        """Concatenate recordings (windows, samples, …) to (1, all samples, …).

        Args:
            windowed: values by window; returned unchanged if windows are not recordings.
            lengths: samples of each recording, those of `parts` if None.
        """
        if not self.parts:
            return windowed
        pieces = zip(windowed, lengths or self.parts, strict=True)
        return np.concatenate([window[:length] for window, length in pieces])[None]


def windows(system: System, samples: int, horizon: int) -> Windows:
    """Consecutive windows of `horizon` samples; without states the recording is one window.

    Raises:
        ModelError: the recording is shorter than one window.
    """
    length = samples if not system.states else min(horizon, samples)
    if length < 2:
        raise ModelError(f"{system.model.name}: found {samples} samples, expected at least 2")
    return Windows(np.arange(0, samples - length + 1, length, dtype=np.int64), length)


def joined(recordings: Sequence[Recording]) -> Recording:
    """Concatenates recordings of the same kind."""
    first = recordings[0]
    if len(recordings) == 1:
        return first
    inputs, outputs = (
        np.concatenate([getattr(each, signals) for each in recordings])
        for signals in ("inputs", "outputs")
    )
    lengths = tuple(map(len, recordings))
    dt, spacings = of_parts([each.dt for each in recordings], lengths)
    begins = np.cumsum([0, *lengths[:-1]]).tolist()
    breaks = tuple(
        begin + at for begin, each in zip(begins, recordings, strict=True) for at in each.breaks
    )
    return replace(
        first,
        dt=dt,
        inputs=inputs,
        outputs=outputs,
        parts=lengths,
        passed=min(each.passed for each in recordings),
        breaks=breaks,
        spacings=spacings,
        begun=tuple(at for each in recordings for at in each.times_begun),
    )


def apart(recording: Recording) -> list[Recording]:
    """Each of the concatenated recordings by itself; the residuals of none are thinned."""
    return [recording.stretch(own.start, own.stop) for own in recording.slices]


def with_effects(model: Model, recording: Recording) -> Recording:
    """The first samples of a recording, in which effects are present: see `Model.presence`."""
    if model.presence is None:
        return recording
    return recording.stretch(0, int(np.sum(recording.inputs[:, model.presence] > 0.0)))


def of_parts(spacings: Sequence[float], lengths: Sequence[int]) -> tuple[float, tuple[float, ...]]:
    """`dt` and `spacings` of a recording of parts.

    Args:
        spacings: time between samples of each part [s].
        lengths: samples of each.
    """
    if max(spacings) <= min(spacings) * (1 + SAME_SPACING):
        return spacings[0], ()
    return float(np.average(spacings, weights=lengths)), tuple(spacings)


def beginning(recording: Recording, samples: int) -> Recording:
    """The first samples of a recording, as one part."""
    inputs, outputs = recording.inputs[:samples], recording.outputs[:samples]
    thinning = recording.thinning and recording.thinning.of_part(len(inputs))
    breaks = tuple(at for at in recording.breaks if at < len(inputs))
    return replace(
        recording, dt=recording.own_spacings[0], inputs=inputs, outputs=outputs, thinning=thinning,
        parts=(), breaks=breaks, spacings=(), begun=recording.begun[:1],
    )  # fmt: skip


def cut_for(system: System, recording: Recording, horizon: int, *, apart: bool = False) -> Windows:
    """`windows`, or one per recording if requested or if only effects have states.

    Effect states do not carry over from one recording to the next, and run through all of it.
    """
    parts, only_effects = recording.parts, bool(system.states and not system.model.states)
    if len(parts) < 2 or not (apart or only_effects):
        return windows(system, len(recording), len(recording) if only_effects else horizon)
    starts = np.cumsum([0, *parts[:-1]]).astype(np.int64)
    return Windows(starts, max(parts), parts)


def initial_states(system: System, recording: Recording, smoothed: int = 11) -> FloatArray:
    """States from the channels at every sample, shape (n, states), as start of a fit.

    Args:
        system: its states name the channels.
        recording: the channels.
        smoothed: odd number of samples over which a rate of change is computed.
    """
    channels = {
        output.channel or name: recording.outputs[:, index]
        for index, (name, output) in enumerate(system.model.outputs.items())
    }
    found = np.empty((len(recording), len(system.states)))
    for index, state in enumerate(system.states.values()):
        found[:, index] = state.start
        if state.measured in channels:
            for part in recording.slices:
                measured = channels[state.measured][part]
                if np.isfinite(measured).any():
                    found[part, index] = filled(measured)
        elif state.rate_of in channels:
            for part, dt in zip(recording.slices, recording.own_spacings, strict=True):
                found[part, index] = rate_of_change(channels[state.rate_of][part], smoothed, dt)
    return found


def rate_of_change(channel: FloatArray, smoothed: int, dt: float) -> FloatArray:
    """Rate of change over an odd number of samples; zeros for a channel too short for it."""
    width = min(smoothed, len(channel) - 1 + len(channel) % 2)
    if width < 5:
        return np.zeros(len(channel))
    return np.asarray(scipy.signal.savgol_filter(filled(channel), width, 3, deriv=1, delta=dt))


def shown_states(system: System) -> set[int]:
    """Columns of the states measured by a channel or by its rate."""
    outputs = system.model.outputs.items()
    channels = {output.channel or name for name, output in outputs}
    return {
        index
        for index, state in enumerate(system.states.values())
        if state.measured in channels or state.rate_of in channels
    }


def filled(signal: FloatArray) -> FloatArray:
    """The signal with gaps interpolated linearly; zeros if it has no valid sample."""
    good = np.isfinite(signal)
    if not good.any():
        return np.zeros_like(signal)
    at = np.arange(len(signal))
    return np.interp(at, at[good], signal[good])


def ends_of_holes(signals: FloatArray) -> tuple[int, ...]:
    """First samples after long holes in what drives a model: no state is followed through them.

    Args:
        signals: shape (n, signals), NaN without a valid sample.
    """
    missing = np.concatenate([[False], ~np.isfinite(signals).all(axis=1), [False]])
    begins, ends = np.flatnonzero(np.diff(missing)).reshape(-1, 2).T
    return tuple(ends[ends - begins >= LONG_HOLE].tolist())

"""The noise floor: the smallest error that can be reached, and how it is estimated.

Repeated periods of the excitation are best: their differences are noise, and where a converter's
step hides them, so is what its rounding makes. Next best is a healthy recording, which also
includes model error, and then the noise that the study states. Otherwise the quietest band of the
residual, assumed to be white noise, gives a lower limit, or what does not repeat with an excitation
of any period where that is less: missing physics may fill all bands.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from rigwatch.physics.engine.fit import Fit, Recording, apart
from rigwatch.physics.transfer import period_by_correlation, shortest_period
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.workbench.data.noise.error_spectrum import ErrorSpectrum, that_count
from rigwatch.workbench.data.noise.quietest_band import quietest_band
from rigwatch.workbench.data.noise.rounding import rounding
from rigwatch.workbench.data.noise.stated import stated_rms
from rigwatch.workbench.data.noise.unrepeated import counted_samples, unrepeated
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.study import Study

METHODS = {
    "periods": "differences between repeated periods of the excitation",
    "healthy": "the error of the model on a healthy recording",
    "healthy motion": "the error of the model along the motion of a healthy recording",
    "stated": "the noise that the study states",
    "repeats": "what of the residual does not repeat with the excitation: a lower limit",
    "quiet band": "the quietest band of the residual, assumed to be white noise: a lower limit",
}
ALLOWED = {
    "periods": 1.1,
    "healthy": 1.1,
    "healthy motion": 1.05,
    "stated": 1.1,
    "repeats": 1.25,
    "quiet band": 1.25,
}
"""Largest ratio of error to noise floor at which nothing remains to be explained, by method."""
BY_CHANCE = 0.1
"""Energy above the model's own error, in units of the noise floor, that chance leaves."""
FEWEST_PERIODS = 3
"""Periods of one recording; of several, as many differences between periods."""
REPEATED = 2e-4
"""Mean square difference of an input one period later, relative to its own; rms 1 % of each."""
SAME_PERIOD = 1e-3
"""Relative difference from whole samples up to which it is the clock's, not the period's."""
_PERIODS: WeakKeyDictionary[Recording, int] = WeakKeyDictionary()
_WITHIN: WeakKeyDictionary[Recording, int] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Noise of each channel.

    Attributes:
        rms: in the channels' units, shape (outputs,).
        method: key of `METHODS`.
        chance: largest ratio of error to floor that a short recording reaches with noise alone.
        own_error: the error that the model's healthy error lets expect along this motion, by
            frequency; None if that is not known.
        train_rms: the same as `rms` of the training, where its recordings have more noise than
            those held out; None if that is not known.
    """

    rms: FloatArray
    method: str
    chance: float = 1.0
    own_error: ErrorSpectrum | None = None
    train_rms: FloatArray | None = None

    @property
    def of_training(self) -> "NoiseFloor":
        """That of the training."""
        return self if self.train_rms is None else replace(self, rms=self.train_rms, train_rms=None)

    @property
    def lower_limit(self) -> bool:
        """Whether it is only the least that the noise can be."""
        return self.method in {"quiet band", "repeats"}

    @property
    def allowed(self) -> float:
        """Largest ratio of error to floor at which nothing remains to be explained."""
        return max(self.usual, self.chance)

    @property
    def usual(self) -> float:
        """The same for recordings so long that chance does not matter."""
        return ALLOWED[self.method]

    def ratio(self, fitted: Fit, at: BoolArray | None = None) -> float:
        """Error over the floor, over all channels; `at`: samples used, shape (windows, length)."""
        rms = fitted.rms if at is None else fitted.rms_at(at)
        return float(np.sqrt(np.mean((rms / self.rms) ** 2)))

    def times(self, fitted: Fit) -> float:
        """Error over the floor as a reader divides them: both over all channels, as they are told.

        That differs from `ratio` where the floor is not the same share of each channel's scale.
        """
        error, least = (np.mean((rms / fitted.scale) ** 2) for rms in (fitted.rms, self.rms))
        return float(np.sqrt(error / least))

    def above(self, fitted: Fit) -> float:
        """Share of the error's energy that is above the floor."""
        return max(1 - self.ratio(fitted) ** -2, 0.0)

    def reached(self, fitted: Fit) -> bool:
        """Whether the error is at the noise floor."""
        return self.ratio(fitted) <= self.allowed

    def left_over(
        self, before: Fit, after: Fit, at: BoolArray | None = None, *, tolerant: bool = False
    ) -> float:
        """Share of the energy above the floor that remains from one fit to a better one.

        Args:
            before, after: the fits.
            at: samples to use, shape (windows, length); all if None.
            tolerant: count an error at the noise floor as zero.
        """
        least = self.allowed**2 if tolerant else 1.0
        above = self.ratio(before, at) ** 2 - 1
        return max(self.ratio(after, at) ** 2 - least, 0.0) / max(above, 1e-12)

    def beyond_own_error(self, before: Fit, after: Fit, at: BoolArray | None = None) -> float:
        """Share of the energy beyond the model's own error that remains from one fit to another.

        Args:
            before, after, at: as in `left_over`.

        Returns:
            Infinite if the model's own error, or a fit's, is not known by frequency.
        """
        if self.own_error is None:
            return math.inf
        left, above = (self.own_error.beyond(f.residuals, self.rms, at) for f in (after, before))
        if not np.isfinite([left, above]).all():
            return math.inf
        counts = that_count(above)
        return max(float(left[counts].sum()) - BY_CHANCE, 0.0) / max(float(above.sum()), 1e-12)


def from_residual(
    fitted: Fit, recording: Recording, period: float, horizon: int, *, at_once: bool = False
) -> NoiseFloor:
    """The floor from repeated periods if there are enough, otherwise a lower limit.

    Args:
        fitted: the fit with its residuals.
        recording: the recording it was fitted to.
        period: of the excitation [s]; 0 to search for one in the inputs.
        horizon: samples between re-initialisations; a period must hold a whole number of them.
        at_once: whether the outputs follow from the inputs at once, so that what a wrong model
            leaves repeats with them.
    """
    factor = recording.thinning.factor if recording.thinning else 1
    samples = _in_samples(period / recording.dt) if period else _period_within(recording)
    series = fitted.residuals.reshape(-1, fitted.residuals.shape[-1])
    if samples and (samples % horizon == 0 or len(fitted.residuals) == 1) and samples % factor == 0:
        found = _between(_apart(series, recording), samples // factor)
        if found is not None:
            return NoiseFloor(np.maximum(found, rounding(recording)), "periods")
    rate = 1 / (recording.dt * factor)
    top = 0.38 if factor > 1 else recording.passed
    bands = [
        quietest_band([channel], rate, top, derived)
        for channel, derived in zip(series.T, recording.derivatives, strict=True)
    ]
    quiet, chances = zip(*bands, strict=True)
    own = unrepeated(fitted, recording) if at_once else None
    if own is not None and np.all(own[0] < quiet):
        return NoiseFloor(own[0], "repeats", own[1])
    return NoiseFloor(np.array(quiet), "quiet band", max(chances))


def _in_samples(period: float) -> int:
    """The first whole number of samples that is one period or several.

    At a period of 33.3 samples the 33rd is none: over ten of them the phase is another.
    """
    several = (count * period for count in range(1, round(1 / SAME_PERIOD)))
    return next((round(n) for n in several if abs(round(n) - n) <= SAME_PERIOD * n), 0)


def repeats_at_once(study: Study) -> bool:
    """Whether what repeats with the excitation counts as left by a wrong model.

    The outputs must follow from the inputs at once. Before an effect is accepted it does not count:
    laws that share what is missing, such as two kinds of hysteresis, would stay rivals for what is
    little beside it.

    Args:
        study: its model and accepted effects.
    """
    return not study.model.states and bool(study.file.effects)


def held_out_floor(study: Study, data: Data, train: Fit, held_out: Fit) -> NoiseFloor:
    """The floor of a study's held-out recordings, and of its training, from a fit's residuals.

    Args:
        study, data: the study.
        train, held_out: the fit, and its parameters on the recordings held out.
    """
    period, at_once = study.file.period, repeats_at_once(study)
    found = from_residual(held_out, data.held_out, period, data.horizon, at_once=at_once)
    if found.method == "quiet band":
        own = from_residual(train, data.train, period, data.horizon)
        if own.method == found.method:
            found = replace(found, train_rms=np.maximum(found.rms, own.rms))
    # Along the measured motion, its noise is in the residual as well.
    if data.along_motion or not found.lower_limit:
        return found
    return _with_stated(found, stated_rms(study, data.held_out))


def _with_stated(floor: NoiseFloor, stated: FloatArray) -> NoiseFloor:
    """The floor with the stated noise, NaN where there is none, in place of a lower limit."""
    if np.isnan(stated).any():
        return replace(floor, rms=np.where(np.isnan(stated), floor.rms, stated))
    return NoiseFloor(stated, "stated")


def lowered(floor: NoiseFloor, study: Study, data: Data, train: Fit, held_out: Fit) -> NoiseFloor:
    """The floor, or that of another fit's quietest band in the channels where it is lower.

    Missing physics may fill all bands of a residual, as friction that reverses does. A floor from
    repeated periods or a healthy recording stays.

    Args:
        floor: from the residuals of another fit.
        study, data, train, held_out: as in `held_out_floor`.
    """
    if floor.method != "quiet band":
        return floor
    own = held_out_floor(study, data, train, held_out)
    both = (floor.of_training.rms, own.of_training.rms)
    return replace(floor, rms=np.minimum(floor.rms, own.rms), train_rms=np.minimum(*both))


def find_period(recording: Recording) -> int:
    """Period in samples after which all inputs that drive the rig repeat to 1 %; 0 if they do not.

    Inputs of different periods repeat together after their least common multiple. It is searched
    for once a recording: each fit to it asks.
    """
    if recording not in _PERIODS:
        _PERIODS[recording] = _common_period(recording)
    return _PERIODS[recording]


def _period_within(recording: Recording) -> int:
    """The same for each of the concatenated recordings by itself, which may begin anywhere in it.

    One that is too short to hold it twice tells nothing, for or against it.
    """
    if len(recording.slices) == 1:
        return find_period(recording)
    if recording not in _WITHIN:
        _WITHIN[recording] = _period_of_each(apart(recording))
    return _WITHIN[recording]


def _period_of_each(recordings: Sequence[Recording]) -> int:
    periods = [_common_period(each) for each in recordings]
    common = math.lcm(*filter(None, periods)) if any(periods) else 0
    lengths = [len(each) // 2 for each, own in zip(recordings, periods, strict=True) if not own]
    told = common <= max(map(len, recordings)) // 2 and all(half < common for half in lengths)
    return common if told else 0


def _common_period(recording: Recording) -> int:
    drive = recording.excitation.T
    periods = [period_by_correlation(signal, _allowed) for signal in drive]
    if not periods or not all(periods):
        return 0
    common = math.lcm(*periods)
    together = common <= len(recording) // 2
    return common if together and all(shortest_period(u, [common], _allowed) for u in drive) else 0


def _allowed(later: FloatArray) -> float:
    return REPEATED * float(np.mean(later**2))


def _apart(series: FloatArray, recording: Recording) -> list[FloatArray]:
    """Residuals (n, outputs) of each of the concatenated recordings: a period is of one of them."""
    ends = np.cumsum(counted_samples(recording))
    return np.split(series, np.minimum(ends[:-1], len(series)))


def _between(parts: Sequence[FloatArray], samples: int) -> FloatArray | None:
    """Noise of each output by what differs between the periods of each recording, (outputs,).

    None if they hold too few periods.
    """
    squares, freedom, whole = np.zeros(parts[0].shape[1]), np.zeros(parts[0].shape[1]), 0
    for part in parts:
        count = len(part) // samples
        periods = part[: count * samples].reshape(count, samples, -1)
        there = np.isfinite(periods)
        counted = there.sum(axis=0)
        mean = np.where(there, periods, 0.0).sum(axis=0) / np.maximum(counted, 1)
        squares += np.sum(np.where(there, periods - mean, 0.0) ** 2, axis=(0, 1))
        freedom += np.sum(np.maximum(counted - 1, 0), axis=0)
        whole += max(count - 1, 0)
    if whole < FEWEST_PERIODS - 1 or not freedom.all():
        return None
    return np.asarray(np.sqrt(squares / freedom))


def quiet_scale(recording: Recording) -> FloatArray:
    """Noise of each channel from its own quietest band, used as weight of the channel."""
    sizes = np.nanstd(recording.outputs, axis=0)
    quiet = np.array(
        [
            quietest_band(
                [channel[part] for part in recording.slices],
                1 / recording.dt,
                recording.passed,
                derived,
            )[0]
            for channel, derived in zip(recording.outputs.T, recording.derivatives, strict=True)
        ]
    )
    least: FloatArray = 1e-6 * np.where(sizes > 0, sizes, 1.0)
    return np.asarray(np.maximum(quiet, least), np.float64)


def scale_of_several(recording: Recording) -> FloatArray | None:
    """The noise of each channel as its weight, shape (outputs,); None if there is only one."""
    return quiet_scale(recording) if recording.outputs.shape[1] > 1 else None

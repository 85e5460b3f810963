"""Limits from healthy recordings: the residual's size, its growth with motion, its extremes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from monitor.drives import steady_energies
from monitor.model import HealthyLimits
from monitor.observer import (
    DEVIATIONS,
    DISAGREE,
    EVIDENCE,
    LASTING,
    MEASURED,
    MEDIUM,
    OUTPUTS,
    SHORT,
    SPREAD,
    DecisionRules,
    E,
    Extremes,
    Spectrum,
    decide,
    new_state,
    steady_motion,
)
from monitor.signals import Codes
from rigwatch.wire.arrays import FloatArray

NEVER = 1 << 40
CHANCE = 3.0
"""Standard deviations that a random residual's friction reaches within a recording. That of a
generator which repeats itself to the sample is the same in each period: it shows one of the values
that it takes as soon as the generator's clock slides.
"""
LOW, HIGH = 5.0, 90.0
"""Percentiles of windows that represent the spread at rest, and its growth with the motion."""


@dataclass(frozen=True, eq=False)
class HealthyPart:
    """A healthy recording: judged columns, speed, levels of the motion, energy of the drive,
    states, spectrum, and pace and energies of the drive.

    The last three begin after the start, during which they are transient.
    """

    judged: FloatArray
    speed: FloatArray
    levels: FloatArray
    drive: FloatArray
    state: Codes
    motion: Spectrum
    pace: FloatArray
    bands: FloatArray

    def energies(self, column: int, skip: int) -> FloatArray:
        """Mean squares of a judged column over medium windows."""
        return _energies(self.judged[skip:, column], MEDIUM)

    def grown(self, skip: int) -> FloatArray:
        """Mean levels over medium windows, shape (windows, levels)."""
        return np.column_stack([mean_over(level[skip:], MEDIUM) for level in self.levels.T])


def _sensor_limits(parts: Sequence[HealthyPart], skip: int) -> tuple[float, float, float]:
    """Noise of what two sensors disagree by, its growth with the motion, and the largest energy
    over both.
    """
    gaps = [part.energies(DISAGREE, skip) for part in parts]
    sizes = [part.energies(MEASURED, skip) for part in parts]
    noise, growth = spread(np.concatenate(gaps), np.concatenate(sizes))
    largest = max(
        float(np.max(gap / (noise**2 + growth**2 * size)))
        for gap, size in zip(gaps, sizes, strict=True)
    )
    return noise, growth, largest


def healthy_limits(
    parts: Sequence[HealthyPart], speed_noise: float, skip: int, rate: float
) -> HealthyLimits:
    """Limits from healthy recordings.

    Args:
        parts: the recordings.
        speed_noise: speed that cannot be distinguished from rest.
        skip: number of samples skipped at the start of each.
        rate: sample rate [Hz].
    """
    errors = [part.energies(E, skip) for part in parts]
    noise, growth = variance(errors, [part.grown(skip) for part in parts])
    sensor_noise, sensor_growth, sensor = _sensor_limits(parts, skip)
    rules = DecisionRules(
        noise, growth, 1.0, np.inf, 1.0, 1.0, 0.0, 1.0, speed_noise, NEVER, 1, 1.0
    )  # fmt: skip
    largest = [_extremes(part, rules, skip) for part in parts]
    drives = [steady_energies(part.bands) for part in parts]
    motions = [
        steady_motion(p.motion, p.pace, own, rate, drive)
        for p, own, drive in zip(parts, largest, drives, strict=True)
    ]
    steady = [motion for motion in motions if motion is not None]
    return HealthyLimits(
        noise=noise, growth=tuple(growth.tolist()),
        short=max(own.short for own in largest), medium=max(own.medium for own in largest),
        friction=max(own.friction for own in largest),
        sensor_noise=sensor_noise, sensor_growth=sensor_growth, sensor=sensor,
        speed_noise=speed_noise,
        steady_paces=tuple(motion.pace for motion in steady),
        steady_sizes=tuple(motion.size for motion in steady),
        steady_narrow=tuple(motion.narrow for motion in steady),
        steady_drives=tuple(motion.drive for motion in steady),
        steady_drive_energies=tuple(e for drive in drives for e in drive),
        steady_motion_bands=tuple(e for motion in steady for e in motion.bands),
        steady_energies=tuple(motion.extremes.lasting for motion in steady),
        steady_shorts=tuple(motion.extremes.short for motion in steady),
        steady_mediums=tuple(motion.extremes.medium for motion in steady),
        steady_frictions=tuple(motion.extremes.friction for motion in steady),
        steady_onsets=tuple(motion.extremes.onset for motion in steady),
        steady_skews=tuple(figure for motion in steady for figure in motion.shape),
    )  # fmt: skip


def _extremes(part: HealthyPart, rules: DecisionRules, skip: int) -> Extremes:
    """Largest energies and friction of a recording, relative to its healthy spread."""
    out = _tried(part, rules)
    allowed = out[SPREAD] ** 2
    error = part.judged[:, E]
    relative = error[skip:] ** 2 / allowed[skip:]
    medium = _largest(error, MEDIUM, allowed, skip)
    by_chance = CHANCE * float(np.sqrt(medium))
    return Extremes(
        lasting=float(mean_over(relative, min(LASTING, relative.size)).max()),
        short=_largest(error, SHORT, allowed, skip),
        medium=medium,
        friction=max(float(np.abs(out[DEVIATIONS][skip:]).max()), by_chance),
        onset=max(float(out[EVIDENCE][skip:].max()), by_chance),
    )


def variance(
    errors: Sequence[FloatArray], levels: Sequence[FloatArray]
) -> tuple[float, FloatArray]:
    """Noise n and growth κ ≥ 0 of a variance n² + κ·A, fitted with relative weights.

    Args:
        errors: mean squares over windows, one array per recording.
        levels: mean levels over the same windows, shape (windows, levels).
    """
    error, level = np.concatenate(errors), np.concatenate(levels)
    least = float(np.percentile(error, LOW))
    columns = np.column_stack([np.full(error.size, least), level]) / (error + least)[:, None]
    found, _ = nnls(columns, error / (error + least))
    return float(np.sqrt(max(found[0], 0.5) * least)), found[1:]


def spread(errors: FloatArray, levels: FloatArray) -> tuple[float, float]:
    """n and κ of a variance n² + κ²·A² from mean squares over windows."""
    noise = float(np.percentile(errors, LOW))
    moving = levels > 1e-3 * levels.max()
    growth = float(np.percentile(np.maximum(errors - noise, 0.0)[moving] / levels[moving], HIGH))
    return float(np.sqrt(noise)), float(np.sqrt(growth))


def mean_over(signal: FloatArray, length: int) -> FloatArray:
    """Means over all windows of one length, shape (n - length + 1,)."""
    total = np.cumsum(np.concatenate([[0.0], signal]))
    return np.asarray((total[length:] - total[:-length]) / length)


def _energies(signal: FloatArray, length: int) -> FloatArray:
    """Mean squares over all windows of one length."""
    return mean_over(signal**2, length)


def _largest(signal: FloatArray, length: int, allowed: FloatArray, skip: int) -> float:
    energy = _energies(signal, length)
    return float(np.max((energy / allowed[length - 1 :])[skip:]))


def _tried(part: HealthyPart, rules: DecisionRules) -> FloatArray:
    """The decision's columns for a recording, with the limits disabled."""
    out = np.zeros((len(OUTPUTS), len(part.state)))
    inside, steady, jumped = np.ones((3, len(part.state)), np.bool_)
    jumped[:] = False
    usual = np.full((len(Extremes._fields), len(part.state)), np.inf)
    response = altered = np.zeros(len(part.state))
    kept = new_state(part.levels.shape[1])
    decide(
        part.judged, part.speed, part.levels, part.drive, inside, jumped, steady, usual,
        response, altered, part.state, rules, kept, out,
    )  # fmt: skip
    out[SPREAD] = np.maximum(out[SPREAD], rules.noise)
    return out

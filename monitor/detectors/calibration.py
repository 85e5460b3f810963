"""Settings of the detectors from a healthy recording, as plain figures for the model file.

Every detector has two functions here or in the registry: one that turns a healthy recording into a
table of figures, and one that builds the detector from the table. The recording should contain the
excitation to be monitored: the thresholds must leave room for the model's error there.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from monitor.detectors.adaptive_threshold import AdaptiveThreshold, fit_threshold
from monitor.detectors.detector import Channels
from monitor.detectors.high_pass import high_passed, leaky
from monitor.detectors.innovation_test import nis_limit
from monitor.detectors.parity import OperatingPoint, ParityDetector
from monitor.detectors.unknown_input import UnknownInputDetector
from monitor.detectors.unknown_input_filters import NoiseModel
from monitor.signals import GOOD, NEW_BOOT
from rigwatch.physics.transfer import TransferFunction
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

Figures = Mapping[str, float]
MARGIN = 1.5
"""Ratio of the limits to the largest healthy residual [1]."""
CORNER = 0.3
"""High-pass that follows the operating point [Hz]: below the excitation, above drift."""
SETTLED = 8.0
"""Settling time in time constants [1]."""
NIS_WINDOW = 64
FALSE_ALARM = 1e-9
"""Probability of a false alarm in one window with a correct model [1]."""
DRIVE_SHARE, STATE_SHARE = 1e-8, 1e-8
"""W as shares of the variances of input and model error: it only keeps the gains above 0 [1]."""


def time_constant(function: TransferFunction, sample_rate: float) -> float:
    """Slowest time constant [s]: the high-pass removes slower ones."""
    high_passed = 1.0 / (2.0 * np.pi * CORNER)
    radii = np.clip(np.abs(function.poles), 1e-3, 1.0 - 1e-9)
    constants = -1.0 / (sample_rate * np.log(radii))
    return float(np.minimum(constants, high_passed).max(initial=0.0))


def calibrate_parity(
    function: TransferFunction,
    healthy: Sequence[FloatArray],
    sample_rate: float,
    *,
    moving_average: bool,
) -> dict[str, float]:
    """Operating point and adaptive threshold from healthy recordings, each of shape (n, 2 or more).

    Raises:
        ModelError: a recording is too short to settle.
    """
    settle = _settling(sample_rate)
    _refuse_short(healthy, settle)
    slowest = time_constant(function, sample_rate)
    point = OperatingPoint(CORNER, 0.0, 0.0, settle)
    free = AdaptiveThreshold(0.0, 0.0, 0.0, slowest)
    residuals = []
    for signals in healthy:
        detector = ParityDetector(
            function, free, point, Channels(), sample_rate, moving_average=moving_average
        )
        plain = np.ascontiguousarray(signals[:, :2])
        residuals.append(detector.judge(plain, _codes(len(signals))).value)
    inputs = [high_passed(signals[:, 0], CORNER, sample_rate) for signals in healthy]
    threshold = fit_threshold(
        np.concatenate(residuals), np.concatenate(inputs), sample_rate, slowest, MARGIN
    )
    return {**asdict(threshold), **asdict(point)}


def make_parity(
    function: TransferFunction,
    figures: Figures,
    channels: Channels,
    sample_rate: float,
    *,
    moving_average: bool,
) -> ParityDetector:
    """The detector calibrated by `calibrate_parity`."""
    threshold = AdaptiveThreshold(*(figures[name] for name in ("floor", "gain", "lead", "lag")))
    point = OperatingPoint(figures["corner"], figures["u0"], figures["y0"], int(figures["settle"]))
    return ParityDetector(
        function, threshold, point, channels, sample_rate, moving_average=moving_average
    )


def calibrate_unknown_input(
    function: TransferFunction, healthy: Sequence[FloatArray], sample_rate: float
) -> dict[str, float]:
    """Noise and limit from healthy recordings, each of shape (n, 3), or (n, 2) without
    acceleration.

    The limit is the chi-square one. A linear model of a nonlinear plant leaves innovations that are
    neither white nor normal, so the measurements' variances, in proportion to the model's error in
    each, are scaled until the largest healthy sum is `MARGIN` below that limit.

    Raises:
        ModelError: a recording is too short to settle.
    """
    settle = _settling(sample_rate)
    _refuse_short(healthy, settle + NIS_WINDOW)
    errors = np.max([_model_errors(function, one, sample_rate, settle) for one in healthy], axis=0)
    limit = nis_limit(NIS_WINDOW, healthy[0].shape[1] - 1, FALSE_ALARM)

    def noise(scale: float) -> NoiseModel:
        return NoiseModel(
            input=DRIVE_SHARE * max(float(np.var(one[:, 0])) for one in healthy),
            state=STATE_SHARE * float(errors[0]),
            position=scale * float(errors[0]),
            acceleration=scale * float(errors[1]),
            window=NIS_WINDOW,
            limit=limit,
            settle=settle,
            corner=CORNER,
        )

    def largest_sum(scale: float) -> float:
        sums = [_nis_sums(function, noise(scale), one, sample_rate) for one in healthy]
        return max(float(np.nanmax(one)) for one in sums)

    return asdict(noise(_falls_to(limit / MARGIN, largest_sum)))


def make_unknown_input(
    function: TransferFunction, figures: Figures, channels: Channels, sample_rate: float
) -> UnknownInputDetector:
    """The detector calibrated by `calibrate_unknown_input`."""
    plain = {name: figures[name] for name in ("input", "state", "position", "acceleration")}
    noise = NoiseModel(
        **plain,
        window=int(figures["window"]),
        limit=figures["limit"],
        settle=int(figures["settle"]),
        corner=figures["corner"],
    )
    return UnknownInputDetector(function, noise, channels, sample_rate)


def _codes(n: int) -> NDArray[np.int64]:
    code = np.full(n, GOOD, np.int64)
    code[0] = NEW_BOOT
    return code


def _settling(sample_rate: float) -> int:
    """Number of samples after a start that are not judged."""
    return int(SETTLED / (2.0 * np.pi * CORNER) * sample_rate)


def _refuse_short(healthy: Sequence[FloatArray], needed: int) -> None:
    shortest = min((len(signals) for signals in healthy), default=0)
    if shortest < 2 * needed:
        raise ModelError(
            f"detectors: found {shortest} healthy samples, expected at least {2 * needed}"
        )


def _model_errors(
    function: TransferFunction, signals: FloatArray, sample_rate: float, settle: int
) -> tuple[float, float]:
    """Variance of the model's error in position [m²] and acceleration [m²/s⁴], 1 without one."""
    model = leaky(function, CORNER, sample_rate)
    u, y = (high_passed(signals[:, i], CORNER, sample_rate) for i in (0, 1))
    position = float(np.var((y - model.simulate(u))[settle:]))
    if signals.shape[1] < 3:
        return position, 1.0
    a = high_passed(signals[:, 2], CORNER, sample_rate)
    modelled = model.second_difference(sample_rate).simulate(u)
    return position, float(np.var((a[:-1] - modelled[1:])[settle:]))


def _nis_sums(
    function: TransferFunction, noise: NoiseModel, signals: FloatArray, sample_rate: float
) -> FloatArray:
    channels = Channels(acceleration="acceleration" if signals.shape[1] > 2 else "")
    detector = UnknownInputDetector(function, noise, channels, sample_rate)
    return detector.judge(np.ascontiguousarray(signals), _codes(len(signals))).value


def _falls_to(target: float, of: Callable[[float], float]) -> float:
    """Where the falling function `of` reaches `target`, by bisection of the logarithm."""
    low, high = 1e-5, 1e2
    for _ in range(16):
        middle = float(np.sqrt(low * high))
        if of(middle) > target:
            low = middle
        else:
            high = middle
    return high

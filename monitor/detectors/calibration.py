"""Settings of the detectors from a healthy recording, as plain figures for the model file.

Every detector has two functions here or in the registry: one that turns a healthy recording into a
table of figures, and one that builds the detector from the table. The recording should hold the
excitation that will be watched: what the model gets wrong there is what the thresholds must leave
room for.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace

import numpy as np
from numpy.typing import NDArray

from monitor.admission import GOOD, NEW_BOOT
from monitor.detectors.adaptive_threshold import AdaptiveThreshold, fit_threshold
from monitor.detectors.detector import Channels
from monitor.detectors.innovation_test import nis_limit
from monitor.detectors.parity import OperatingPoint, ParityDetector, high_pass
from monitor.detectors.unknown_input import NoiseModel, UnknownInputDetector
from rigwatch.physics.transfer_function import FloatArray, TransferFunction
from rigwatch.wire.errors import ModelError

Figures = Mapping[str, float]
MARGIN = 1.5
"""Limits stand this much above the largest healthy residual [1]."""
CORNER = 0.3
"""High-pass that follows the operating point [Hz]: below the excitation, above drift."""
SETTLED = 5.0
"""Time constants after which a start is forgotten [1]."""
NIS_WINDOW = 64
FALSE_ALARM = 1e-9
"""Chance of a false alarm in one window of a right model [1]."""


def slowest_constant(function: TransferFunction, sample_rate: float) -> float:
    """Slowest time constant of a stable function [s]."""
    radius = float(np.abs(function.poles).max(initial=1e-3))
    return float(min(-1.0 / (sample_rate * np.log(min(radius, 1.0 - 1e-6))), 10.0))


def calibrate_parity(
    function: TransferFunction,
    signals: FloatArray,
    sample_rate: float,
    *,
    moving_average: bool,
) -> dict[str, float]:
    """Operating point and adaptive threshold from healthy input and output, shape (n, 2 or more).

    Raises:
        ModelError: the recording is too short to settle.
    """
    slowest = slowest_constant(function, sample_rate)
    settle = SETTLED * max(slowest, 1.0 / (2.0 * np.pi * CORNER)) * sample_rate
    point = OperatingPoint(CORNER, 0.0, 0.0, int(settle))
    _refuse_short(signals, int(settle))
    free = ParityDetector(
        function,
        AdaptiveThreshold(0.0, 0.0, 0.0, slowest),
        point,
        Channels(),
        sample_rate,
        moving_average=moving_average,
    )
    residual = free.judge(np.ascontiguousarray(signals[:, :2]), _codes(len(signals))).value
    u = high_pass(CORNER, sample_rate).simulate(signals[:, 0] - signals[0, 0])
    lag = min(slowest, 1.0)
    threshold = fit_threshold(residual, u, sample_rate, lag, MARGIN)
    return {**asdict(threshold), **asdict(point)}


def make_parity(
    function: TransferFunction,
    figures: Figures,
    channels: Channels,
    sample_rate: float,
    *,
    moving_average: bool,
) -> ParityDetector:
    """The detector that `calibrate_parity` has prepared."""
    threshold = AdaptiveThreshold(*(figures[name] for name in ("floor", "gain", "lead", "lag")))
    point = OperatingPoint(figures["corner"], figures["u0"], figures["y0"], int(figures["settle"]))
    return ParityDetector(
        function, threshold, point, channels, sample_rate, moving_average=moving_average
    )


def calibrate_unknown_input(
    function: TransferFunction, signals: FloatArray, sample_rate: float
) -> dict[str, float]:
    """Noise and limit from healthy input, position and acceleration, shape (n, 2 or 3).

    Sensor noise is what differences of a high order leave; q is the one at which the innovations
    are as large as expected on average. A linear model of a nonlinear plant leaves innovations that
    are not white, so the limit is the chi-square one or `MARGIN` above the largest healthy sum,
    whichever is higher.

    Raises:
        ModelError: the recording is too short to settle.
    """
    settle = int(SETTLED * slowest_constant(function, sample_rate) * sample_rate)
    _refuse_short(signals, settle + NIS_WINDOW)
    position = _noise_variance(signals[:, 1])
    acceleration = _noise_variance(signals[:, 2]) if signals.shape[1] > 2 else 1.0
    noise = NoiseModel(0.0, 1e-2 * position, position, acceleration, NIS_WINDOW, np.inf, settle)
    measurements = signals.shape[1] - 1

    def sums(drive: float) -> FloatArray:
        return _nis_sums(function, replace(noise, input=drive), signals, sample_rate)

    drive = _drive_variance(sums, NIS_WINDOW * measurements, float(np.var(signals[:, 0])))
    largest = float(np.nanmax(sums(drive)))
    limit = max(nis_limit(NIS_WINDOW, measurements, FALSE_ALARM), MARGIN * largest)
    return asdict(replace(noise, input=drive, limit=limit))


def make_unknown_input(
    function: TransferFunction, figures: Figures, channels: Channels, sample_rate: float
) -> UnknownInputDetector:
    """The detector that `calibrate_unknown_input` has prepared."""
    plain = {name: figures[name] for name in ("input", "state", "position", "acceleration")}
    noise = NoiseModel(
        **plain,
        window=int(figures["window"]),
        limit=figures["limit"],
        settle=int(figures["settle"]),
    )
    return UnknownInputDetector(function, noise, channels, sample_rate)


def _codes(n: int) -> NDArray[np.int64]:
    code = np.full(n, GOOD, np.int64)
    code[0] = NEW_BOOT
    return code


def _refuse_short(signals: FloatArray, needed: int) -> None:
    if len(signals) < 2 * needed:
        raise ModelError(
            f"detectors: found {len(signals)} healthy samples, expected at least {2 * needed}"
        )


def _noise_variance(values: FloatArray) -> float:
    """Variance of white noise under a smooth signal, from its sixth differences."""
    gain = float(np.sum(np.array([1, 6, 15, 20, 15, 6, 1]) ** 2))
    floor = 1e-6 * float(np.var(values)) + 1e-300
    return max(float(np.mean(np.diff(values, 6) ** 2)) / gain, floor)


def _nis_sums(
    function: TransferFunction, noise: NoiseModel, signals: FloatArray, sample_rate: float
) -> FloatArray:
    channels = Channels(acceleration="acceleration" if signals.shape[1] > 2 else "")
    detector = UnknownInputDetector(function, noise, channels, sample_rate)
    return detector.judge(np.ascontiguousarray(signals), _codes(len(signals))).value


def _drive_variance(
    sums: Callable[[float], FloatArray], expected: float, input_variance: float
) -> float:
    """q at which the mean sum is as expected, by bisection: the sum falls with q."""
    low, high = np.log(1e-8 * input_variance), np.log(1e4 * input_variance)
    for _ in range(24):
        middle = 0.5 * (low + high)
        if np.nanmean(sums(float(np.exp(middle)))) > expected:
            low = middle
        else:
            high = middle
    return float(np.exp(high))

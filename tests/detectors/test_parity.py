"""Höfling and Deibert: a third-order process of known order, faults of sensor and static gain.
gain.

The thesis reviews it without figures (section 2.2). Chosen here: a flow control with time constants
of 2, 1 and 0.4 s and static gain 1.5, sampled every 0.1 s, whose set point changes stepwise; a
numerator b1 … b4 with b0 = 0, as in (2.43).
"""

import numpy as np
import pytest

from monitor.detectors.adaptive_threshold import (
    AdaptiveThreshold,
    fit_threshold,
    new_threshold_state,
    threshold_block,
)
from monitor.detectors.detector import Channels
from monitor.detectors.parity import OperatingPoint, ParityDetector
from monitor.signals.admission import GOOD, NEW_BOOT
from rigwatch.physics.transfer.transfer_function import TransferFunction
from rigwatch.wire.errors import ModelError

RATE = 10.0
GAIN = 1.5
NOISE = 0.004
SILENT = AdaptiveThreshold(0.0, 0.0, 0.0, 1.0)


def process(gain: float = GAIN, constants: tuple[float, ...] = (2.0, 1.0, 0.4)):
    """Third order, b0 = 0, static gain `gain`."""
    denominator = np.real(np.poly(np.exp(-1.0 / (RATE * np.array(constants)))))
    shape = np.array([0.0, 0.2, 1.0, 0.5, 0.1])
    numerator = gain * shape * denominator.sum() / shape.sum()
    return TransferFunction.of(numerator, denominator)


def set_points(seconds: float = 200.0) -> np.ndarray:
    """Input that changes stepwise every 20 s."""
    levels = np.array([0.0, 0.5, 0.2, 1.0, 1.0, 0.4, 0.0, 0.7, 0.7, 0.7])
    return np.repeat(levels, round(seconds * RATE / len(levels)))


def judged(detector: ParityDetector, u: np.ndarray, y: np.ndarray):
    code = np.full(u.size, GOOD, np.int64)
    code[0] = NEW_BOOT
    return detector.judge(np.column_stack([u, y]), code)


def residual(u, y, *, moving_average: bool, function: TransferFunction | None = None):
    function = function or process()
    point = OperatingPoint()
    detector = ParityDetector(
        function, SILENT, point, Channels(), RATE, moving_average=moving_average
    )
    return judged(detector, u, y).value


@pytest.mark.parametrize(("fault_y", "fault_u"), [(0.1, 0.0), (0.0, 0.2), (-0.05, 0.3)])
def test_constant_faults_leave_the_published_residuals(fault_y, fault_u):
    """(2.50) and (2.51), after the transient."""
    function, u = process(), set_points()
    y = function.simulate(u)
    faulty = residual(u + fault_u, y + fault_y, moving_average=False)
    at_one = float(function.b.sum() / function.a.sum())
    assert at_one == pytest.approx(GAIN)
    assert faulty[-1] == pytest.approx(fault_y - at_one * fault_u, rel=1e-9)
    faulty = residual(u + fault_u, y + fault_y, moving_average=True)
    expected = function.a.sum() * fault_y - function.b.sum() * fault_u
    assert faulty[-1] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("moving_average", [False, True])
def test_without_a_fault_nothing_is_left(moving_average):
    u = set_points()
    left = residual(u, process().simulate(u), moving_average=moving_average)
    assert np.nanmax(np.abs(left)) < 1e-12


@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_models_of_any_order(order):
    function = process(constants=tuple(np.linspace(0.3, 2.0, order)))
    u = set_points()
    y = function.simulate(u) + 0.1
    left = residual(u, y, moving_average=False, function=function)
    assert left[-1] == pytest.approx(0.1, rel=1e-9)


def test_ma_forgets_a_pulse_within_its_order_and_arma_within_its_poles():
    """The two residuals differ in how long they remember (2.45), (2.46)."""
    function, u = process(), set_points()
    pulse = np.zeros(u.size)
    pulse[500] = 1.0
    y = function.simulate(u)
    order = max(function.a.size, function.b.size) - 1
    moving = residual(u + pulse, y, moving_average=True)
    assert np.abs(moving[500 : 501 + order]).max() > 5e-4
    assert np.abs(moving[501 + order :]).max() < 1e-12
    running = residual(u + pulse, y, moving_average=False)
    assert np.abs(running[520]) > 1e-3
    assert np.abs(running[500 + 300]) < 1e-5


def test_an_unstable_model_cannot_run_beside_the_plant():
    with pytest.raises(ModelError, match="unstable"):
        residual(
            np.zeros(5),
            np.zeros(5),
            moving_average=False,
            function=TransferFunction.of([0.0, 1.0], [1.0, -1.1]),
        )


class TestAdaptiveThreshold:
    """A plant that is not quite the model: 8 % more gain and slower by 15 %."""

    plant = process(gain=1.08 * GAIN, constants=(2.3, 1.0, 0.4))

    def run(self, seed: int, fault: float = 0.0):
        """Residual and input; a sensor fault from 185 s on, while the input is constant."""
        u = set_points()
        noise = NOISE * np.random.default_rng(seed).standard_normal(u.size)
        y = self.plant.simulate(u) + noise
        y[1850:] += fault
        return residual(u, y, moving_average=False), u

    def limit(self, threshold: AdaptiveThreshold, u: np.ndarray) -> np.ndarray:
        return threshold_block(threshold.coefficients(RATE), new_threshold_state(), u)

    def test_a_fixed_limit_from_rest_is_left_by_every_set_point_change(self):
        r, u = self.run(seed=1)
        fixed = 5.0 * np.std(r[: np.flatnonzero(u)[0]])
        changes = np.flatnonzero(np.diff(u)) + 1
        left = [np.any(np.abs(r[at : at + 100]) > fixed) for at in changes]
        assert all(left)

    def test_the_adaptive_limit_is_left_by_none(self):
        r, u = self.run(seed=1)
        threshold = fit_threshold(r, u, RATE, slowest=2.3, margin=1.3)
        for seed in range(2, 22):
            r, u = self.run(seed)
            assert not np.any(np.abs(r) > self.limit(threshold, u))

    def test_at_rest_it_sees_what_a_fixed_limit_wide_enough_cannot(self):
        r, u = self.run(seed=1)
        threshold = fit_threshold(r, u, RATE, slowest=2.3, margin=1.3)
        wide = 1.3 * np.abs(r).max()
        fault = 0.04
        quiet = residual(np.zeros(u.size), _noise(u.size) + fault, moving_average=False)
        assert not np.any(np.abs(quiet) > wide)
        assert np.all(np.abs(quiet)[5:] > self.limit(threshold, np.zeros(u.size))[5:])

    def test_it_still_finds_a_sensor_fault_at_an_operating_point(self):
        r, u = self.run(seed=1)
        threshold = fit_threshold(r, u, RATE, slowest=2.3, margin=1.3)
        r, u = self.run(seed=3, fault=0.4)
        found = np.flatnonzero(np.abs(r) > self.limit(threshold, u))
        assert found[0] == 1850

    def test_it_rises_at_once_and_falls_with_its_lag(self):
        threshold = AdaptiveThreshold(floor=0.1, gain=0.5, lead=3.0, lag=1.5)
        u = np.concatenate([np.zeros(10), np.ones(200), np.zeros(100)])
        limit = self.limit(threshold, u)
        assert limit[9] == pytest.approx(0.1)
        decay = np.exp(-1.0 / (RATE * 1.5))
        first = 0.5 * ((1 - decay) + 2.0 * decay)
        assert limit[10] == pytest.approx(0.1 + first, rel=1e-12)
        assert limit[209] == pytest.approx(0.1 + 0.5, rel=1e-5)
        assert np.all(np.diff(limit[211:]) < 0.0)
        at = 209 + round(3 * 1.5 * RATE)
        assert limit[at] < 0.1 + 0.5 * 2.0 * np.exp(-2.8)

    def test_bad_figures_are_refused(self):
        for figures in ((-1.0, 1.0, 1.0, 1.0), (0.0, np.nan, 1.0, 1.0), (0.0, 1.0, 1.0, 0.0)):
            with pytest.raises(ModelError, match="adaptive threshold"):
                AdaptiveThreshold(*figures)

    def test_without_a_judged_sample_there_is_nothing_to_fit(self):
        with pytest.raises(ModelError, match="no judged sample"):
            fit_threshold(np.full(10, np.nan), np.zeros(10), RATE, 1.0, 1.3)


def _noise(n: int) -> np.ndarray:
    return NOISE * np.random.default_rng(99).standard_normal(n)

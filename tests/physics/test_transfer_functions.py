"""Transfer functions: simulation in blocks, fits that find what was put in, velocity."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from rigwatch.physics.transfer.frequency_fit import fit_transfer_function
from rigwatch.physics.transfer.frequency_response import frequency_response
from rigwatch.physics.transfer.output_error import OutputErrorOrders, fit_output_error
from rigwatch.physics.transfer.transfer_function import Filter, TransferFunction, reflected
from rigwatch.physics.transfer.velocity import velocity_filter
from rigwatch.wire.errors import ModelError

RATE = 256.0
RESONANCE = 0.96 * np.exp(2j * np.pi * 8.4 / RATE)
RIG = TransferFunction.of([0.0, 2e-5], np.poly([0.995, RESONANCE, np.conj(RESONANCE), 0.5]).real)


@given(cuts=st.lists(st.integers(1, 299), max_size=6))
@settings(max_examples=30, deadline=None)
def test_cutting_the_input_changes_no_bit(cuts: list[int]) -> None:
    u = np.random.default_rng(0).standard_normal(300)
    running = Filter(RIG)
    parts = [running.update(part) for part in np.split(u, sorted(set(cuts)))]
    assert np.array_equal(np.concatenate(parts), RIG.simulate(u))


def test_simulation_is_that_of_scipy() -> None:
    u = np.random.default_rng(1).standard_normal(500)
    assert np.allclose(RIG.simulate(u), lfilter(RIG.b, RIG.a, u), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("order", range(7))
def test_filters_of_every_order_are_those_of_scipy(order: int) -> None:
    random = np.random.default_rng(order)
    roots = random.uniform(-0.9, 0.9, order)
    rig = TransferFunction.of(random.standard_normal(order + 1), np.atleast_1d(np.poly(roots)))
    u = random.standard_normal(200)
    assert np.allclose(rig.simulate(u), lfilter(rig.b, rig.a, u), rtol=1e-9, atol=1e-12)


def test_response_is_that_of_the_impulse() -> None:
    impulse = np.zeros(4096)
    impulse[0] = 1.0
    quick = TransferFunction.of([0.2, 0.1], [1.0, -0.7])
    spectrum = np.fft.rfft(quick.simulate(impulse))
    frequency = np.fft.rfftfreq(4096, 1.0 / RATE)
    assert np.allclose(quick.response(frequency, RATE), spectrum)


def chirp(seconds: float) -> np.ndarray:
    t = np.arange(int(seconds * RATE)) / RATE
    return 0.7 * np.sin(2 * np.pi * (0.1 * t + 0.5 * 20.0 / seconds * t**2))


def test_chirp_gives_the_transfer_function_back() -> None:
    u = chirp(60.0)
    y = RIG.simulate(u) + 1e-6 * np.random.default_rng(2).standard_normal(u.size)
    found = fit_transfer_function(frequency_response(u, y, RATE).band(0.5, 18.0, 0.8))
    lines = np.linspace(2.0, 12.0, 40)
    ratio = found.response(lines, RATE) / RIG.response(lines, RATE)
    assert np.max(np.abs(ratio - 1.0)) < 0.1
    assert found.is_stable


def test_coherence_falls_where_there_is_noise() -> None:
    u = chirp(60.0)
    noise = np.random.default_rng(3).standard_normal(u.size)
    clean = frequency_response(u, RIG.simulate(u), RATE).band(2.0, 10.0)
    noisy = frequency_response(u, RIG.simulate(u) + 0.01 * noise, RATE).band(2.0, 10.0)
    assert np.median(clean.coherence) > 0.99 > np.median(noisy.coherence)


def test_a_constant_input_is_refused() -> None:
    with pytest.raises(ModelError, match="constant input"):
        frequency_response(np.ones(500), np.zeros(500), RATE)


def test_a_band_without_lines_is_refused() -> None:
    with pytest.raises(ModelError, match="expected at least 8"):
        frequency_response(chirp(20.0), chirp(20.0), RATE).band(50.0, 50.1)


@pytest.mark.parametrize("seed", range(3))
def test_output_error_finds_the_filter(seed: int) -> None:
    true = TransferFunction.of([1.0, 0.5, 0.2, 0.1], np.poly([0.9, 0.8 + 0.2j, 0.8 - 0.2j]).real)
    t = np.arange(800)
    u = np.sign(np.sin(0.2 * t)) + 0.3 * np.sin(0.2 * t + 0.3)
    y = true.simulate(u)
    y = y + 0.01 * y.std() * np.random.default_rng(seed).standard_normal(y.size)
    found = fit_output_error(u, y, OutputErrorOrders(4, 3, 0))
    assert found.explained > 0.999
    lines = RATE * 0.2 / (2 * np.pi) * np.array([1.0, 3.0, 5.0])
    ratio = found.function.response(lines, RATE) / true.response(lines, RATE)
    assert np.max(np.abs(ratio - 1.0)) < 0.05


def test_output_error_stays_stable_on_an_unstable_plant() -> None:
    u = np.random.default_rng(4).standard_normal(300)
    y = lfilter([1.0], [1.0, -1.02], u)
    assert fit_output_error(u, y, OutputErrorOrders(2, 2, 0)).function.is_stable


def test_output_error_refuses_silence() -> None:
    with pytest.raises(ModelError, match="zeros"):
        fit_output_error(np.zeros(300), np.zeros(300), OutputErrorOrders(4, 3, 0))


@given(radius=st.floats(0.1, 3.0), angle=st.floats(0.0, 3.1))
def test_reflection_leaves_no_root_outside(radius: float, angle: float) -> None:
    root = radius * np.exp(1j * angle)
    a = np.poly([root, np.conj(root), 0.5]).real
    assert np.all(np.abs(np.roots(reflected(a))) < 1.0)


@pytest.mark.parametrize("frequency", [3.0, 4.0, 8.0])
def test_velocity_has_no_lead(frequency: float) -> None:
    piezo = 0.5
    s = 2j * np.pi * frequency
    sensed = s / (s + 2 * np.pi * piezo)
    one = np.array([frequency])
    plain = velocity_filter(0.5, RATE, compensate_lead=False).response(one, RATE)[0]
    better = velocity_filter(0.5, RATE, piezo).response(one, RATE)[0]
    assert abs(np.angle(better * sensed * s)) < 0.25 * abs(np.angle(plain * sensed * s))
    assert abs(better * sensed * s) == pytest.approx(1.0, abs=0.2)


def test_a_bias_of_the_accelerometer_does_not_become_a_velocity() -> None:
    settled = velocity_filter(0.5, RATE, 0.5).simulate(np.ones(8000))
    assert abs(settled[-1]) < 1e-9


def test_a_velocity_filter_is_made_once_and_nobody_can_change_it_for_the_others() -> None:
    function = velocity_filter(0.5, RATE, 0.3)
    assert velocity_filter(0.5, RATE, 0.3) is function
    for shared in (function.b, function.a):
        with pytest.raises(ValueError, match="read-only"):
            shared[0] = 0.0

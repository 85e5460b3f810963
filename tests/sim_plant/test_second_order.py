"""The plant of the numerical validation against closed forms."""

import numpy as np
import pytest

from sim_plant.second_order import CASES, FAULT_TIME, STEP, Fault, simulate, validation


def steady_amplitude(damping: float) -> float:
    """Of the acceleration under 3 sin(2 pi 4 t), m = k = 1."""
    w = 2 * np.pi * 4.0
    return float(3.0 * w**2 / abs(1.0 - w**2 + 1j * w * damping))


@pytest.mark.parametrize("case", CASES)
def test_signals_are_alike_until_the_fault(case: int):
    v = validation(case, seed=1)
    before = v.time < FAULT_TIME
    assert v.time.size == 4000
    assert np.array_equal(v.acceleration_faulty[before], v.acceleration_healthy[before])
    assert not np.array_equal(v.acceleration_faulty[~before], v.acceleration_healthy[~before])


def test_viscous_case_has_the_closed_form_amplitude():
    v = validation(1, seed=1)
    healthy, faulty = v.acceleration_healthy[-400:], v.acceleration_faulty[-400:]
    assert np.abs(healthy).max() == pytest.approx(steady_amplitude(2.2), rel=2e-3)
    assert np.abs(faulty).max() == pytest.approx(steady_amplitude(9.2), rel=2e-3)


@pytest.mark.parametrize("case", CASES)
def test_signals_fulfil_the_equation_of_motion(case: int):
    fault = CASES[case]
    x, v, a = simulate(fault)[2001:].T
    u = validation(case, seed=1).input[2001:]
    rest = u - x - (2.2 + fault.viscous) * v - fault.coulomb * np.sign(v) - a
    assert np.abs(rest).max() < 1e-12
    steps = np.abs(np.diff(v) / STEP - 0.5 * (a[1:] + a[:-1]))
    assert np.median(steps) < 5e-3


def test_dry_friction_above_the_input_stops_it_exactly():
    _, v, a = simulate(Fault(coulomb=5.0, viscous=0.0))[2200:].T
    assert np.all(v == 0.0)
    assert np.all(a == 0.0)


def test_noise_is_uniform_two_percent_and_from_the_seed():
    one, two, same = validation(2, seed=1), validation(2, seed=2), validation(2, seed=1)
    noise = one.acceleration_measured - one.acceleration_faulty
    width = 0.02 * np.abs(one.acceleration_faulty[one.time < FAULT_TIME]).max()
    assert 0.98 * width < np.abs(noise).max() <= width
    assert noise.std() == pytest.approx(width / np.sqrt(3), rel=0.05)
    assert np.array_equal(one.velocity_measured, same.velocity_measured)
    assert not np.array_equal(one.velocity_measured, two.velocity_measured)

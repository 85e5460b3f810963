"""The rig moves as its physics says: air spring, energy, rest, balance of forces, end stops."""

import numpy as np
import pytest
from msgspec import structs

from sim_plant.parameters import RigParameters
from sim_plant.rig import Rig

from .rig_runs import RATE, SEALED, settled, sine


def stiffness(p: RigParameters, p1: float, p2: float) -> float:
    """Of two closed chambers at mid stroke, each n P A^2 / V [N/m]."""
    areas = p.piston_area, p.annulus_area
    volumes = [p.dead_volume + area * p.stroke / 2 for area in areas]
    parts = zip((p1, p2), areas, volumes, strict=True)
    return p.heat_capacity_ratio * sum(pressure * a**2 / v for pressure, a, v in parts)


def free_swing(p: RigParameters, seconds: float, coulomb: float = 0.0, force: float = 0.5):
    rig = Rig(p, seed=0)
    rig.set_effect("constant_force", force)
    rig.set_effect("coulomb", coulomb)
    return rig.advance(np.zeros(round(seconds * RATE))).truth


def frequency_of(x: np.ndarray) -> float:
    rest = x - 0.5 * (x.max() + x.min())
    before = np.flatnonzero((rest[:-1] < 0) & (rest[1:] >= 0))
    times = (before - rest[before] / (rest[before + 1] - rest[before])) / RATE
    return (times.size - 1) / (times[-1] - times[0])


def test_air_spring_swings_at_the_measured_resonance():
    truth = free_swing(SEALED, 20.0)
    mass = SEALED.piston_mass + SEALED.load_mass
    expected = np.sqrt(stiffness(SEALED, truth["P1"][0], truth["P2"][0]) / mass)
    assert frequency_of(truth["x"]) == pytest.approx(expected / (2 * np.pi), rel=2e-3)
    assert frequency_of(truth["x"]) == pytest.approx(8.4, abs=0.2)


def test_air_spring_keeps_its_energy():
    x = free_swing(SEALED, 60.0)["x"]
    first, last = np.ptp(x[: 256 * 5]), np.ptp(x[-256 * 5 :])
    assert last == pytest.approx(first, rel=1e-3)


def test_dry_friction_takes_four_times_its_force_over_stiffness_each_cycle():
    coulomb = 0.02
    truth = free_swing(SEALED, 2.0, coulomb=coulomb)
    k = stiffness(SEALED, truth["P1"][0], truth["P2"][0])
    # Turning points lie where the velocity changes sign; |x - rest| falls by 2 F / k at each.
    turns = np.flatnonzero(truth["v"][:-1] * truth["v"][1:] < 0)[:16]
    swings = np.abs(np.diff(truth["x"][turns]))
    assert -np.diff(swings).mean() == pytest.approx(4 * coulomb / k, rel=0.05)


def test_rig_without_drive_stays_where_it_is():
    truth = Rig(RigParameters(), seed=0).advance(np.zeros(256 * 30)).truth
    assert np.abs(truth["x"]).max() < 1e-7
    assert np.ptp(truth["P1"]) < 1.0


def test_forces_balance_at_rest_against_a_constant_force():
    rig, p = Rig(RigParameters(), seed=0), RigParameters()
    rig.set_effect("constant_force", 0.2)
    truth = rig.advance(np.zeros(256 * 60)).truth
    p1, p2 = truth["P1"][-1], truth["P2"][-1]
    push = p1 * p.piston_area - p2 * p.annulus_area
    push -= p.atmosphere * (p.piston_area - p.annulus_area)
    assert push == pytest.approx(-0.2, abs=1e-4)
    assert 1e-4 < truth["x"][-1] < 0.02


def test_air_flows_into_a_moving_chamber_as_fast_as_it_grows():
    """At a constant voltage and speed, the flow of the port is P A v: dP/dt is near zero."""
    rig = Rig(structs.replace(RigParameters(), centring_gain=0.0), seed=0)
    truth = rig.advance(np.full(256, 0.3)).truth
    late = slice(128, 192)
    growth = np.gradient(truth["P1"][late]) * RATE / truth["P1"][late].mean()
    assert truth["v"][late].mean() > 0.01
    assert np.abs(growth).mean() < 0.2


def test_end_stops_hold_and_take_energy():
    rig, p = Rig(RigParameters(), seed=0), RigParameters()
    truth = rig.advance(np.full(256 * 4, 5.0)).truth
    assert truth["x"].max() < p.stroke / 2 + 0.5e-3
    assert truth["x"][-1] > p.stroke / 2
    assert abs(truth["v"][-1]) < 1e-6
    impact = np.flatnonzero(truth["x"] > p.stroke / 2)[0]
    assert -truth["v"][impact:].min() < 0.8 * truth["v"][:impact].max()


def test_stays_centred_under_drive_for_an_hour():
    rig = Rig(RigParameters(), seed=0)
    for minute in range(60):
        truth = rig.advance(sine(1.4, 8.0, 60.0, start=60.0 * minute)).truth
        assert np.abs(truth["x"]).max() < 0.02
    assert np.abs(truth["x"].mean()) < 0.005


@pytest.mark.parametrize("volts", [1.2, 1.4, 1.5])
def test_acceleration_peaks_as_published(volts: float):
    a = settled(volts, 8.0).truth["a"]
    assert 15 < np.abs(a).max() < 20.5


@pytest.mark.parametrize("effects", [{}, {"coulomb": 0.75}], ids=["healthy", "friction"])
def test_substeps_are_fine_enough(effects: dict[str, float]):
    coarse = settled(1.4, 8.0, effects).truth["a"]
    fine = settled(1.4, 8.0, effects, structs.replace(RigParameters(), substeps=128)).truth["a"]
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.015 * fine.std()

"""Dry friction sticks exactly, slides at its level, and is stable whatever its size."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_plant.parameters import RigParameters
from sim_plant.rig import Rig

from .rig_runs import settled, sine


def longest_rest(v: np.ndarray) -> int:
    """Length of the longest run of velocities that are exactly zero."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], v == 0.0, [0])).astype(int)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def test_sticks_exactly_for_a_part_of_each_cycle():
    truth = settled(1.5, 4.0, {"coulomb": 0.75, "static_ratio": 1.3}).truth
    assert 0.05 < np.mean(truth["v"] == 0.0) < 0.5
    assert longest_rest(truth["v"]) >= 4
    resting = truth["v"] == 0.0
    assert np.all(np.abs(truth["friction"][resting]) <= 0.75 * 1.3 + 1e-9)


def test_slides_at_the_kinetic_level_against_the_motion():
    truth = settled(1.4, 8.0, {"coulomb": 0.3}).truth
    fast = np.abs(truth["v"]) > 0.02
    assert np.allclose(truth["friction"][fast], 0.3 * np.sign(truth["v"][fast]), atol=1e-9)


@given(coulomb=st.floats(0.0, 1e4), ratio=st.floats(1.0, 10.0))
@settings(max_examples=40, deadline=None)
def test_stable_for_any_friction(coulomb: float, ratio: float):
    rig = Rig(RigParameters(), seed=0)
    rig.set_effect("coulomb", coulomb)
    rig.set_effect("static_ratio", ratio)
    truth = rig.advance(sine(5.0, 3.0, 2.0)).truth
    assert all(np.isfinite(values).all() for values in truth.values())
    assert np.abs(truth["v"]).max() < 5.0
    if coulomb > 50.0:
        assert np.all(truth["v"] == 0.0)
        assert np.all(truth["a"] == 0.0)


def test_friction_that_grows_past_all_drive_stops_a_moving_load_for_good():
    rig = Rig(RigParameters(), seed=0)
    rig.advance(sine(1.4, 8.0, 4.0))
    rig.set_effect("coulomb", 1e4)
    truth = rig.advance(sine(1.4, 8.0, 2.0, start=4.0)).truth
    assert np.all(truth["v"][2:] == 0.0)
    assert np.ptp(truth["x"][2:]) == 0.0


def test_friction_only_takes_energy():
    truth = settled(1.4, 8.0, {"coulomb": 0.5, "stribeck": 0.3, "static_ratio": 1.5}).truth
    # `friction` belongs to the step that ends at the sample, whose velocity is `v`.
    assert np.all(truth["friction"] * truth["v"] >= 0.0)


def dry_friction(effect: str, value: float):
    """Size of the friction [N], velocity [m/s] and position [m] with 0.4 N and one effect."""
    truth = settled(1.4, 8.0, {"coulomb": 0.4, effect: value}).truth
    return np.abs(truth["friction"]), truth["v"], truth["x"]


def test_friction_by_direction_is_larger_outwards():
    size, v, _ = dry_friction("coulomb_direction", 0.2)
    assert np.allclose(size[v > 0.02], 0.6)
    assert np.allclose(size[v < -0.02], 0.2)


def test_binding_grows_with_the_distance_from_the_centre():
    size, v, x = dry_friction("binding", 50.0)
    fast = np.abs(v) > 0.05
    assert np.allclose(size[fast], 0.4 + 50.0 * np.abs(x[fast]), atol=0.01)


def test_stribeck_friction_fades_with_speed():
    size, v, _ = dry_friction("stribeck", 0.4)
    assert np.allclose(size[np.abs(v) > 0.15], 0.4, atol=1e-3)
    assert size[(np.abs(v) < 0.05) & (v != 0)].max() > 0.5


def test_stiction_holds_a_resting_load_until_it_is_overcome():
    rig = Rig(RigParameters(), seed=0)
    rig.set_effect("coulomb", 0.2)
    rig.set_effect("stiction", 1.0)
    ramp = np.arange(256 * 8) / (256 * 8) * 1.5
    truth = rig.advance(ramp).truth
    start = int(np.flatnonzero(truth["v"])[0])
    held = truth["friction"][start - 1]
    assert abs(held) == pytest.approx(1.2, abs=0.02)
    assert abs(truth["friction"][start + 2]) == pytest.approx(0.2, abs=1e-9)

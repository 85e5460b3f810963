"""Machines that hide effects: each is at rest at first, and each effect shows in what it reads."""

import numpy as np
import pytest

from sim_plant.machines import MACHINES, Machine, cascade, log, strength_for, tanks

NEW = [name for name in MACHINES if name != "oscillator"]


def read(machine: Machine, hidden: dict[str, float], seed: int = 1) -> np.ndarray:
    return machine.run(machine.drive(seed), hidden)


@pytest.mark.parametrize(
    ("name", "effect"), [(name, effect) for name in NEW for effect in MACHINES[name].effects]
)
def test_an_effect_changes_what_is_read_by_the_share_asked_for(name, effect):
    machine = MACHINES[name]
    first = machine.commanded + machine.precise
    healthy = read(machine, {})[:, first:]
    strength = strength_for(machine, effect, 0.05, seed=1)
    moved = read(machine, {effect: strength})[:, first:] - healthy
    share = np.sqrt(np.mean(moved**2, axis=0)) / healthy.std(axis=0)
    assert share.max() == pytest.approx(0.05, rel=0.25)


@pytest.mark.parametrize("name", NEW)
def test_it_rests_before_it_is_driven(name):
    signals = read(MACHINES[name], {})
    moved = np.abs(signals[5] - signals[0])
    assert (moved <= 0.05 * np.ptp(signals, axis=0)).all()


def test_a_log_has_the_noise_that_is_asked_for_and_exact_commands():
    machine = MACHINES["motor"]
    table, clean = log(machine, {}, 0.02, seed=3), read(machine, {}, seed=3)
    np.testing.assert_array_equal(table["voltage_V"], clean[:, 0])
    noise = table["speed_rad_s"] - clean[:, 1]
    assert noise.std() == pytest.approx(0.02 * clean[:, 1].std(), rel=0.05)


def test_the_speed_of_a_healthy_motor_settles_where_torque_and_back_emf_balance():
    from sim_plant.machines.motor import CONSTANT, DAMPING, EFFECTS, RATE, RESISTANCE, run

    out = np.empty((1000, 1))
    run(np.full(1000, 6.0), np.zeros(len(EFFECTS)), out, np.full(1000, 1 / RATE))
    settled = CONSTANT * 6.0 / (CONSTANT**2 + RESISTANCE * DAMPING)
    assert out[-1, 0] == pytest.approx(settled, rel=1e-6)


def test_a_pendulum_hangs_where_torque_and_weight_balance():
    from sim_plant.machines.pendulum import CONSTANT, EFFECTS, GRAVITY, RATE, RESISTANCE, run

    out = np.empty((1500, 1))
    run(np.full(1500, 2.0), np.zeros(len(EFFECTS)), out, np.full(1500, 1 / RATE))
    assert np.sin(out[-1, 0]) == pytest.approx(2.0 * CONSTANT / RESISTANCE / GRAVITY, rel=1e-4)


@pytest.mark.parametrize(
    ("plant", "holes"),
    [pytest.param(tanks, tanks.HOLES, id="tanks"),
     pytest.param(cascade, cascade.HOLES[1:], id="cascade")],
)  # fmt: skip
def test_tanks_settle_where_what_comes_in_goes_out(plant, holes):
    out = np.empty((3000, len(holes)))
    plant.run(np.full(3000, 5.0), np.zeros(len(plant.EFFECTS)), out, np.full(3000, 1 / plant.RATE))
    left = np.array(holes) * np.sqrt(2 * plant.FALL * out[-1])
    np.testing.assert_allclose(left, plant.PUMP * 5.0, rtol=1e-4)


def test_a_tank_that_nothing_fills_runs_dry_as_its_jet_slows():
    # A·dh/dt = −a·√(2·g·h): the speed of the jet falls linearly, to zero and no further.
    out, (upper, lower) = np.empty((60, 1)), zip(cascade.HOLES, cascade.GROUND, strict=True)
    cascade.run(np.zeros(60), np.zeros(len(cascade.EFFECTS)), out, np.full(60, 1 / cascade.RATE))
    speed = np.sqrt(2 * cascade.FALL * out[:, 0])
    hole, ground = upper
    empty = cascade.PUMP * cascade.RESTING / hole * ground / (cascade.FALL * hole)
    alone = speed[int(np.ceil(empty * cascade.RATE)) :][:3]
    slows = cascade.FALL * lower[0] / lower[1] / cascade.RATE
    np.testing.assert_allclose(-np.diff(alone), slows, rtol=1e-6)
    assert speed[-1] == 0.0

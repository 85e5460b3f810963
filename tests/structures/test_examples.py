"""Examples of the methods that the thesis reviews, and the case that it gave up."""

import numpy as np
import pytest

from rigwatch.physics.engine.equations.model import load_model
from rigwatch.structures.identification.identify import identify
from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.records.record import Record
from sim_plant import tower
from sim_plant.earthquake import accelerogram
from sim_plant.structure import simulate, with_noise
from tests.structures.antenna import FILE, FOLDER, antenna, positions
from tests.structures.extreme import Extreme

FRAME = {"columns": 25.0, "columns_cubic": 2.5, "joints": 1.0, "joints_cubic": 0.1}
CHAIN = """
name = "chain"
summary = "Two masses and three springs in a row."
[nodes]
1.mass = 1.0
2.mass = 1.5
[springs]
lower = { between = ["1"], stiffness = 400.0 }
middle = { between = ["1", "2"], stiffness = 300.0 }
upper = { between = ["2"], stiffness = 200.0 }
"""
NEAR = {"columns": 24.0, "columns_cubic": 2.0, "joints": 0.9, "joints_cubic": 0.08}


@pytest.fixture(scope="module")
def frame():
    shaken = {"ground": accelerogram(0.01, 20.0, 1)}
    return simulate(FOLDER / "shear_frame.toml", 0.01, 20.0, recorded=shaken)


@pytest.mark.parametrize(
    ("method", "guess"),
    [("direct", {}), ("gauss-newton", NEAR), ("kalman", {}), ("quasilinearization", {}),
     ("shooting", {})],
)  # fmt: skip
def test_distefanos_frame_has_the_true_values(frame, method, guess):
    structure = load_structure(FOLDER / "shear_frame.toml")
    found = identify(method, structure, Record(0.01, frame.columns), list(FRAME), guess)
    for name, value in FRAME.items():
        assert found.parameters[name] == pytest.approx(value, rel=2e-3), method


def test_the_direct_approach_deteriorates_with_noisy_accelerations(frame):
    structure = load_structure(FOLDER / "shear_frame.toml")
    noisy = with_noise(frame, {"a_roof": 0.05}, 3)
    record = Record(
        0.01, {name: noisy.columns[name] for name in ("x_roof", "v_roof", "a_roof", "ground")}
    )
    direct = identify("direct", structure, record).parameters["columns_cubic"]
    best = identify("shooting", structure, record).parameters["columns_cubic"]
    assert abs(direct - 2.5) > 0.5
    assert abs(best - 2.5) < 0.01


@pytest.mark.parametrize("method", ["kalman", "shooting", "quasilinearization"])
def test_imais_tower_with_twelve_unknowns(method):
    made = tower.tower(0.02, 60.0)
    found = identify(method, load_model(FOLDER / "offshore_tower.toml"), Record(0.02, made.columns))
    truth = {
        f"{name}{i + 1}{j + 1}": matrix[i, j]
        for name, matrix in (("J", tower.J), ("K", tower.K))
        for i in (0, 1)
        for j in (0, 1)
    }
    truth |= {"D11": 0.15, "D22": 0.25, "L11": 0.5, "L22": 0.7}
    assert len(found.parameters) == 12
    for name, value in truth.items():
        assert found.parameters[name] == pytest.approx(value, rel=5e-3), name


def test_nowakowskis_pendulum_runs_away_and_is_identified():
    made = tower.pendulum(0.01, 6.0)
    model = load_model(FOLDER / "inverted_pendulum.toml")
    found = identify("shooting", model, Record(0.01, made.columns))
    truth = {
        "mass": tower.MASS,
        "moment": tower.MOMENT,
        "inertia": tower.INERTIA,
        "drag": tower.CART_DRAG,
        "damping": tower.PIVOT_DAMPING,
    }
    assert found.remarks
    for name, value in truth.items():
        assert found.parameters[name] == pytest.approx(value, rel=1e-3), name


@pytest.mark.nightly
def test_everything_unknown_of_the_antenna_is_identified():
    found, off = everything_identified(Extreme())
    assert len(found.names) == 36
    assert max(off[name] for name in found.names if name not in found.undetermined) < 0.01
    assert len(found.undetermined) <= 2


def test_everything_unknown_of_a_chain_is_identified(tmp_path):
    (tmp_path / "chain.toml").write_text(CHAIN)
    found, off = everything_identified(Extreme(tmp_path / "chain.toml"))
    assert len(found.names) == 8
    assert max(off.values()) < 0.01
    assert not found.undetermined


def everything_identified(case):
    """All coefficients of a structure, and by how much each is off."""
    found = identify(
        "shooting", case.structure(), case.record(6.0), list(case.truth), case.guesses(),
        partial=True,
    )  # fmt: skip
    off = {name: abs(found.parameters[name] / value - 1) for name, value in case.truth.items()}
    return found, off


def test_a_light_mass_that_nothing_pushes_is_vague_beside_a_heavy_spring():
    made = with_noise(simulate(FILE, 0.01, 5.0), {f"x{n}": 0.02 for n in range(1, 9)}, 2)
    guess = {"m1": 0.0012, "k5_12": 1.3, "k1_6": 1100.0}
    found = identify("shooting", antenna(), positions(made, 0.01), list(guess), guess, partial=True)
    spread = {
        name: (high - low) / 4 / abs(found.parameters[name])
        for name, (low, high) in found.intervals.items()
    }
    assert "k1_6" not in found.undetermined
    assert spread["m1"] > 10 * spread["k1_6"]
    assert spread["k5_12"] > 10 * spread["k1_6"]


def test_the_accelerogram_is_the_same_for_a_seed_and_peaks_at_a_third_of_gravity():
    one, same, other = (accelerogram(0.01, 20.0, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one).max() == pytest.approx(0.34 * 9.81)
    assert not np.allclose(one, other)

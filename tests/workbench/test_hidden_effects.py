"""A part of `benchmarks/hidden_effects`: a plant of other equations hides something."""

import pytest

from benchmarks.hidden_effects import PAIRS, Case, solve
from sim_plant.oscillator import UNKNOWN

SEED = 77


@pytest.mark.parametrize(
    "name", ["coulomb", "cubic_stiffness", "valve_hysteresis", "acceleration_lag"]
)
def test_a_hidden_effect_is_named_and_nothing_but_noise_is_left(name: str) -> None:
    found = solve(Case((name,), 0.02, SEED))
    assert found.right
    assert found.word == "missing_effect"
    assert len(found.first) <= 3
    assert found.after is not None
    assert found.after < 1.1


def test_an_accelerometers_lag_is_not_taken_for_physics() -> None:
    found = solve(Case(("acceleration_lag",), 0.05, SEED))
    assert all(label.endswith("@acceleration_sensor") for label in found.first)


def test_nothing_is_missing_from_a_healthy_plant() -> None:
    found = solve(Case((), 0.0, SEED))
    assert found.word == "nothing_missing"
    assert found.before == pytest.approx(1.0, abs=0.1)


def test_what_no_known_effect_explains_is_said_to_be_unknown() -> None:
    assert solve(Case((UNKNOWN[0],), 0.05, SEED)).word == "unknown_effect"


def test_two_hidden_effects_are_named_in_two_steps() -> None:
    assert solve(Case(PAIRS[0], 0.05, SEED)).both

"""A lateness that stays the same is kept, and friction that begins beside it shows."""

import numpy as np
import pytest

from monitor.observer.lateness import TAU, constant_lateness
from tests.compiled import from_python
from tests.observer.lateness.followed import DRY, LATE, N, learnt

is_constant = from_python(constant_lateness.is_constant)
rubs_beside = from_python(constant_lateness.rubs_beside)


def constant(tau: float) -> np.ndarray:
    """The carried figures of inputs that are late by `tau` since long before."""
    return learnt(tau * LATE, kept=learnt(tau * LATE), judging=True)


@pytest.mark.parametrize("tau", [0.15, 0.5, 0.9])
def test_a_lateness_that_stays_is_constant(tau) -> None:
    kept = constant(tau)

    assert is_constant(kept)
    assert kept[TAU] == pytest.approx(tau, abs=0.01)


def test_that_of_a_clock_0_1_percent_off_is_not() -> None:
    slides = np.linspace(-0.4, 0.6, N) * LATE

    assert not is_constant(learnt(slides, kept=learnt(-0.4 * LATE), judging=True))


@pytest.mark.parametrize("tau", [-0.5, 0.0])
def test_inputs_that_are_early_or_not_late_have_none(tau) -> None:
    assert not is_constant(constant(tau))


def test_one_before_the_rig_is_judged_is_not_constant_yet() -> None:
    assert not is_constant(learnt(0.5 * LATE))


def test_friction_is_not_learnt_as_another_lateness() -> None:
    # It looks like 0.5 samples less: the residual that is left hardly contains any lateness.
    kept = learnt(0.5 * LATE + 0.2 * DRY, kept=constant(0.5), judging=True)

    assert is_constant(kept)
    assert rubs_beside(kept)
    assert kept[TAU] == pytest.approx(0.5, abs=0.05)


def test_a_jump_to_another_lateness_is_followed() -> None:
    kept = learnt(0.2 * LATE, kept=constant(0.9), judging=True)

    assert not rubs_beside(kept)
    assert kept[TAU] == pytest.approx(0.2, abs=0.03)


def test_a_clock_that_drifts_slowly_is_followed() -> None:
    kept = learnt(np.linspace(0.4, 0.55, N) * LATE, kept=constant(0.4), judging=True)

    assert is_constant(kept)
    assert kept[TAU] == pytest.approx(0.55, abs=0.03)

"""Whether edges lie between samples, as the residual shows."""

import numpy as np
import pytest

from monitor.drives import edge_choice, no_edges
from tests.compiled import from_python

corrected = from_python(edge_choice.corrected)
edges_unsure = from_python(edge_choice.edges_unsure)
follow_edges = from_python(edge_choice.follow_edges)
undecided = from_python(edge_choice.undecided)

N, NOISE = 600, 0.1
AT = np.arange(N)
RESPONSE = 1.5 * (0.003 * AT % 1.0) * np.sin(2.0 * np.pi * AT / 32.0)
NOISY = NOISE * np.random.default_rng(7).standard_normal(N)


def followed(error: np.ndarray, kept: np.ndarray, moved: np.ndarray = RESPONSE) -> list[int]:
    """Samples at which the assumption changes."""
    limit = 2.0 * NOISE**2
    return [k for k in range(N) if follow_edges(error[k], moved[k], 0.0, limit, kept)]


def test_edges_between_samples_are_told_from_the_residual() -> None:
    kept = no_edges()

    assert len(followed(RESPONSE + NOISY, kept)) == 1
    assert corrected(1.0, 0.8, kept) == 1.0 - 0.8


def test_edges_at_samples_are_left_alone() -> None:
    kept = no_edges()

    assert not followed(NOISY, kept)
    assert corrected(1.0, 0.8, kept) == 1.0


def test_a_wrong_assumption_is_given_up() -> None:
    kept = no_edges()
    followed(RESPONSE + NOISY, kept)

    assert len(followed(NOISY, kept)) == 1
    assert corrected(1.0, 0.8, kept) == 1.0


@pytest.mark.parametrize(("unsure", "held"), [(0.0, 0.3), (0.8, 0.0)])
def test_edges_that_have_just_shown_are_no_fault_until_they_are_told(unsure, held) -> None:
    kept = no_edges()
    followed(NOISY, kept, 0.0 * NOISY)
    limit = 2.0 * NOISE**2

    # What is not known of them is told apart only by what it leaves, and counts by itself.
    follow_edges(0.8, 0.3, unsure, limit, kept)
    assert undecided(0.3, kept) == held
    taken = [(follow_edges(0.8, 0.3, unsure, limit, kept), undecided(0.3, kept)) for _ in range(N)]
    assert all(left == held for _, left in taken[:32])
    assert taken[-1][1] == 0.0


def test_friction_is_no_edge_between_samples() -> None:
    friction = 2.0 * np.sign(np.sin(2.0 * np.pi * AT / 32.0 + 0.5))

    assert not followed(friction + NOISY, no_edges())


def test_what_was_not_known_of_edges_between_samples_is_remembered() -> None:
    kept = no_edges()
    followed(RESPONSE + NOISY, kept)

    before = [edges_unsure(0.8, kept) for _ in range(N)][-1]
    after = [edges_unsure(0.0, kept) for _ in range(64)][-1]
    assert 0.5 * before < after < 0.8 * before


def test_edges_at_samples_are_sure() -> None:
    assert edges_unsure(0.8, no_edges()) == 0.0

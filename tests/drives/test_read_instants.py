"""How far edges that jitter are from where they are read, as the residual shows."""

import numpy as np
import pytest

from monitor.drives import no_instants, read_instants
from tests.compiled import from_python

follow_instants = from_python(read_instants.follow_instants)
still_unsure = from_python(read_instants.still_unsure)

N, NOISE = 1024, 0.1
AT = np.arange(N)
RESPONSE = np.sin(2.0 * np.pi * AT / 32.0)
"""To what is not known of the instants."""
NOISY = NOISE * np.random.default_rng(7).standard_normal(N)


def followed(
    error: np.ndarray, kept: np.ndarray, *, jitters: bool = True, judging: bool = False
) -> None:
    for k in range(error.size):
        follow_instants(error[k], RESPONSE[k], jitters, NOISE**2, judging, kept)


def test_a_residual_without_a_trace_of_them_shows_that_edges_are_where_they_are_read() -> None:
    kept = no_instants()

    followed(NOISY, kept)

    assert still_unsure(0.5, kept) == 0.0


@pytest.mark.parametrize("size", [0.8, 1.2])
def test_errors_as_large_as_expected_are_allowed_for_in_full(size) -> None:
    kept = no_instants()

    followed(NOISY + size * RESPONSE, kept)

    assert still_unsure(0.5, kept) == 0.5


def test_smaller_errors_are_allowed_for_with_twice_their_energy() -> None:
    kept = no_instants()

    followed(NOISY + 0.4 * RESPONSE, kept)

    # Less by the energy that a healthy residual leaves anyway.
    assert still_unsure(1.0, kept) == pytest.approx(0.4 * np.sqrt(2.0), rel=0.1)


def test_edges_that_have_not_jittered_long_enough_show_nothing() -> None:
    kept = no_instants()

    followed(NOISY[:200], kept)

    assert still_unsure(0.5, kept) == 0.5


def test_edges_that_slide_show_nothing() -> None:
    kept = no_instants()

    followed(NOISY, kept, jitters=False)

    assert still_unsure(0.5, kept) == 0.5


def test_a_fault_that_grows_is_not_allowed_for() -> None:
    kept = no_instants()
    followed(NOISY, kept)

    followed(NOISY + RESPONSE, kept, judging=True)

    assert still_unsure(0.5, kept) == 0.0


def test_the_next_edges_that_jitter_decide_anew() -> None:
    kept = no_instants()
    followed(NOISY, kept)

    for error in NOISY[:300]:
        follow_instants(error, 0.0, False, NOISE**2, True, kept)

    assert still_unsure(0.5, kept) == 0.5

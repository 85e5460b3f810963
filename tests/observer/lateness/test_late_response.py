"""The response to inputs that act late: on the right side of a sample, and as wrong as it is."""

import numpy as np
import pytest
from scipy.signal import lfilter

from monitor.observer.lateness import TAU, late_response, no_lateness
from monitor.observer.lateness.lateness_state import AGO
from monitor.observer.missing_force import COLUMNS, LATE_UNIT, E
from tests.compiled import from_python
from tests.observer.lateness.followed import AT, LATE, NOISE, N, learnt

forget_accuracy = from_python(late_response.forget_accuracy)
measure_accuracy = from_python(late_response.measure_accuracy)
response_to = from_python(late_response.response_to)
unsure_lateness = from_python(late_response.unsure_lateness)

CROSSED = 2.0 * np.cos(AT)
"""What no lateness explains, as large as the response to one sample."""


def test_a_held_input_that_is_late_gains_the_step_before_a_sample() -> None:
    # A plant with two lags, and a generator of 8 Hz at 256 Hz.
    held = np.sin(2.0 * np.pi * np.arange(600) / 32.0)
    before, after = np.roll(held, 1), np.roll(held, -1)
    plant = [0.0, 0.1], [1.0, -1.6, 0.68]
    error = lfilter(*plant, 0.95 * (before - held))[64:-1]
    both, later = (lfilter(*plant, e)[64:-1] for e in (0.5 * (before - after), before - held))
    kept = no_lateness()
    kept[TAU] = 0.95

    found = np.array([response_to(*each, kept) for each in zip(both, later, strict=True)])

    assert _left(error, found) < 1e-4
    assert _left(error, both) > 0.009


def _left(error: np.ndarray, response: np.ndarray) -> float:
    """Share of the energy that no multiple of a response explains."""
    explained = (error @ response) ** 2 / (response @ response)
    return 1.0 - float(explained / (error @ error))


def measured(wrong: float, kept: np.ndarray, age: int = 0) -> np.ndarray:
    """The carried figures after a constant lateness of 0.8 whose response is wrong by a share."""
    rows = np.zeros((N, len(COLUMNS)))
    noise = 0.1 * NOISE * np.random.default_rng(8).standard_normal(N)
    rows[:, LATE_UNIT], rows[:, E] = LATE, 0.8 * (LATE + wrong * CROSSED) + noise
    for since, row in enumerate(rows, age + 1):
        measure_accuracy(row, (0.1 * NOISE) ** 2, since, kept)
    return kept


def late() -> np.ndarray:
    """The carried figures of inputs that have been late by 0.8 samples."""
    kept = no_lateness()
    kept[TAU], kept[AGO] = 0.8, 0.0
    return kept


@pytest.mark.parametrize(
    ("wrong", "unsure"), [(0.0, 0.0), (0.05, 0.0566), (0.15, 0.12), (0.3, 0.12)]
)
def test_errors_of_the_response_are_allowed_for_as_they_are_found(wrong, unsure) -> None:
    # With twice their energy, and at most the one that is allowed for until it is known.
    assert unsure_lateness(measured(wrong, late())) == pytest.approx(unsure, abs=0.003)


def test_what_begins_later_is_not_allowed_for() -> None:
    kept = measured(0.0, late())

    assert unsure_lateness(measured(0.3, kept, age=N)) == 0.0


def test_another_lateness_is_unsure_again() -> None:
    kept = measured(0.0, late())
    forget_accuracy(kept)

    assert unsure_lateness(kept) == pytest.approx(0.12)


def test_inputs_that_slide_are_unsure_where_an_edge_meets_a_sample() -> None:
    assert unsure_lateness(learnt(np.linspace(0.6, 0.0, N) * LATE)) == 0.075
    assert unsure_lateness(learnt(np.zeros(N))) == 0.0

"""Rest of the mass: sticking again and again in one place, told from coasting and slow turning."""

import numpy as np
import pytest

from monitor.decision import isolation, isolation_verdict
from monitor.decision.isolation import Evidence, History, Rest, new_history, store_sample
from monitor.decision.isolation_verdict import Seen
from tests.compiled import from_python

rest_of = from_python(isolation.rest_of)
slips = from_python(isolation_verdict.slips)

NOISE = 1e-6
"""Standard deviation of the position [m]."""
CYCLE = 32


def history(at_rest: np.ndarray, place: np.ndarray) -> History:
    """Samples with these flags of rest and positions [m]."""
    made = new_history(np.ones(1), np.ones(1))
    for rest, position in zip(at_rest, place, strict=True):
        store_sample(made, 0.0, 0.0, 0.0, 0.0, float(rest), 0.0, float(position))
    return made


def rest(at_rest: np.ndarray, drift: float = 0.0) -> Rest:
    """Rest of a mass that drifts by so many standard deviations a sample."""
    n = at_rest.size
    noise = np.random.default_rng(1).normal(0.0, NOISE, n)
    return rest_of(history(at_rest, noise + drift * NOISE * np.arange(n)), n, NOISE)


def stretches(n: int, *spans: tuple[int, int]) -> np.ndarray:
    flags = np.zeros(n)
    for begin, end in spans:
        flags[begin:end] = 1.0
    return flags


def test_stops_are_counted_and_a_flicker_within_one_is_not() -> None:
    flags = stretches(64, (8, 18), (40, 50))
    flags[44:46] = 0.0
    found = rest(flags)
    assert found.stops == 2
    assert found.share == pytest.approx(18 / 64)
    assert found.always == pytest.approx(2 * 8 / 64)


def test_a_mass_that_coasts_is_not_at_rest() -> None:
    assert rest(stretches(64, (8, 24), (40, 60)), drift=1.5) == Rest(0.0, 0.0, 0)


def test_a_mass_that_sticks_may_creep() -> None:
    found = rest(np.ones(400), drift=0.04)
    assert found.share > 0.8
    assert found.always > 0.8


def seen() -> Seen:
    return Seen(0.0, 3 * CYCLE, CYCLE, False, True, True, 0.0, 0.1)


def evidence(at_rest: float, always: float, stops: int, **more: float) -> Evidence:
    others = {"explained": 0.5, "share": 0.0, "rho": 0.1, "rivals": 0.9, "jump": 0.0,
              "together": 0.9, "dry": 0.2, "peak": 0.05}  # fmt: skip
    return Evidence(rest=at_rest, rest_always=always, stops=stops, **{**others, **more})


def test_sticking_again_and_again_is_friction_and_a_single_stop_is_not() -> None:
    assert slips(seen(), evidence(0.25, 0.2, 2))
    assert not slips(seen(), evidence(0.25, 0.2, 1))


def test_a_mass_that_stays_stuck_needs_no_second_stop() -> None:
    assert slips(seen(), evidence(0.8, 0.7, 1))


def test_a_mass_that_mostly_slides_shows_friction_in_its_sliding_too() -> None:
    """A motion that fades, or goes from stop to stop, is slow at its turning points as well."""
    assert not slips(seen(), evidence(0.07, 0.06, 3, share=0.0003, rho=0.3, together=0.998))
    assert slips(seen(), evidence(0.07, 0.06, 3, share=0.03, rho=0.6))
    assert slips(seen(), evidence(0.07, 0.06, 3, explained=0.7, dry=0.9))

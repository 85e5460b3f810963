"""Readings beyond the stroke, where the equations have no solution: the observer begins anew."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.pipeline.observer_pipeline import ObserverMonitor
from tests.monitor.observed_rig import RATE, SINE, block, coulomb, model, raised, run, watched

pytestmark = pytest.mark.long

GLITCH_S, FRICTION_S = 3.0, 5.5


def glitched(place_m: float, length: int) -> dict[str, np.ndarray]:
    channels = run(SINE, 7.0, coulomb(FRICTION_S), seed=4)
    at = round(GLITCH_S * RATE)
    channels["position"][at : at + length] = place_m
    return channels


@pytest.mark.parametrize(("place_m", "length"), [(-0.1, 4), (0.09, 10)])
def test_a_glitch_blinds_the_observer_for_two_seconds_at_most(place_m, length) -> None:
    found = watched(glitched(place_m, length))

    times = raised(found)
    assert GLITCH_S <= times["monitor_reset"] < GLITCH_S + 0.2
    assert FRICTION_S <= times["dry_friction"] < FRICTION_S + 0.5
    assert found.estimates.column("armed").values[round(5.0 * RATE) :].all()


def test_nothing_that_is_not_finite_is_left() -> None:
    found = watched(glitched(-0.1, 4))

    late = slice(round(5.0 * RATE), round(FRICTION_S * RATE))
    assert all(np.isfinite(column.values).all() for column in found.estimates.columns)
    assert found.estimates.column("deviation").values[late].max() < 1.0


def test_block_sizes_change_no_bit_of_a_new_start() -> None:
    channels = glitched(-0.1, 40)
    whole = ObserverMonitor(model()).update(block(channels))
    assert whole is not None
    monitor, n = ObserverMonitor(model()), len(channels["voltage"])
    cuts = [0, 760, 771, 773, 774, 775, 780, 800, 806, 807, 808, 809, 810, 850, n]
    parts = [monitor.update(block(channels, a, b)) for a, b in pairwise(cuts)]

    for column in whole.estimates.columns:
        pieces = [part.estimates.column(column.name).values for part in parts if part]
        assert np.array_equal(np.concatenate(pieces), column.values), column.name

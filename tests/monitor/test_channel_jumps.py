"""Jumps of a channel that shows a state: none in motion, noise, gaps or held samples."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.model import RangeSection
from monitor.observer.channel_jumps import ChannelJumps, bend_orders, bends_of
from monitor.signals import GOOD, HELD, NEW_BOOT, RESTART
from monitor.signals.recordings import recording_of
from rigwatch.physics.engine.equations import shipped_models

RATE, STEP, AT = 256.0, 25.4e-6, 900
MODEL = shipped_models()["servo-pneumatic"]


def position(n: int = 2000, size: float = 7e-3, seed: int = 1) -> np.ndarray:
    """8 Hz with noise, in steps of a converter [m]."""
    rng = np.random.default_rng(seed)
    clean = size * np.sin(2.0 * np.pi * 8.0 * np.arange(n) / RATE)
    return STEP * np.round((clean + 5e-6 * rng.standard_normal(n)) / STEP)


def watch() -> ChannelJumps:
    healthy = recording_of("healthy", "sine", RATE, {"position": position()})
    bends = bends_of([healthy], MODEL)
    seen = RangeSection(
        names=(), low=(), high=(), channels=tuple(bends), bends=tuple(bends.values())
    )
    return ChannelJumps(seen, MODEL, ("voltage", "position"))


def found(values: np.ndarray, code: np.ndarray | None = None) -> np.ndarray:
    code = codes(values.size) if code is None else code
    return watch().update(np.column_stack([0.0 * values, values]), code)[:, 0]


def codes(n: int) -> np.ndarray:
    code = np.full(n, GOOD, np.int64)
    code[0] = NEW_BOOT
    return code


def test_a_position_whose_speed_is_a_state_is_bounded_in_its_second_difference() -> None:
    assert bend_orders(MODEL) == {"position": 2}


@pytest.mark.parametrize("size", [0.0, 7e-3, 9e-3])
def test_motion_of_about_the_same_size_does_not_jump(size: float) -> None:
    assert not found(position(size=size, seed=2)).any()


@pytest.mark.parametrize("size", [1e-3, -2e-3])
def test_a_step_is_a_jump_where_it_happens(size: float) -> None:
    values = position(seed=3)
    values[AT:] += size

    at = np.flatnonzero(found(values))

    assert set(at) <= {AT, AT + 1}
    assert at[0] == AT


@pytest.mark.parametrize("code", [HELD, RESTART])
def test_what_changes_over_a_gap_is_no_jump(code: int) -> None:
    values, given = position(seed=4), codes(2000)
    values[AT:] += 2e-3
    given[AT] = code

    assert not found(values, given).any()


def test_any_cut_gives_the_same() -> None:
    values, given = position(seed=5), codes(2000)
    values[AT:] += 2e-3
    rows, one = np.column_stack([values, values]), watch()
    cuts = [0, 1, 2, AT, AT + 1, 2000]

    parts = [one.update(rows[a:b], given[a:b]) for a, b in pairwise(cuts)]

    assert np.array_equal(np.concatenate(parts)[:, 0], found(values))

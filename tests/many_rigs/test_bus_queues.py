"""The simulated bus: queues as a plain loop has them, and the answers that a formula gives."""

import numpy as np
import pytest

from benchmarks.processes.bus_queues import BLOCK, Costs, Plan, _served, _turns, simulate

FREE = Costs(daq=1e-9, router=1e-9, turn=1e-9, sample=0.0, recorder=1e-9)


def test_a_station_works_as_a_plain_loop_says() -> None:
    rng = np.random.default_rng(3)
    arrived, work = rng.uniform(0, 1, 200), rng.uniform(0, 0.02, 200)
    free, expected = 0.0, np.empty(200)
    order = np.argsort(arrived)
    # The work belongs to the place in the queue, not to what arrives.
    for place, one in enumerate(order):
        free = max(free, arrived[one]) + work[place]
        expected[one] = free
    np.testing.assert_allclose(_served(arrived, work), expected, rtol=1e-12)


def test_what_waits_is_judged_together_and_nothing_is_left() -> None:
    arrived = np.linspace(0.0, 0.1, 50)
    seats = np.arange(50) % 2
    done, spent = _turns(arrived, seats, np.ones(50), 0.03, 0.001)
    assert (done > arrived).all()
    assert len(np.unique(done)) < 20
    assert spent == pytest.approx(0.03 * len(np.unique(done)) + 0.05)


def test_without_work_a_sample_waits_for_its_block_and_a_turn() -> None:
    found = simulate(Plan(4, 4, 4), FREE)
    assert 0.5 * BLOCK < found.p50 < 0.5 * BLOCK + 0.005
    assert BLOCK * 0.98 < found.p99 < BLOCK + 0.005


def test_a_station_beyond_its_time_is_named_by_its_share() -> None:
    found = simulate(Plan(200, 10, 200, threads=1), Costs())
    assert found.busy["router"] > 1.0 > found.busy["monitor"]
    assert found.p99 > 0.5

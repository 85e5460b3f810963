"""Recorders that ask one site for its recordings share its rate, however often each asks."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.recorder.past.shares import MOST_ASKERS, WAITS, Shares


class Server:
    """A server that may serve one page each 0.1 s, in simulated time."""

    def __init__(self) -> None:
        self.shares, self.now, self.free_at = Shares(), 0.0, 0.0
        self.served: dict[str, float] = {}

    def ask(self, name: str, cost: float = 0.1) -> bool:
        if not self.shares.admits(name, self.now):
            return False
        if self.free_at > self.now:
            self.shares.refused(name, self.now)
            return False
        self.shares.served(name, cost, self.now)
        self.free_at = self.now + cost
        self.served[name] = self.served.get(name, 0.0) + cost
        return True


def run(server: Server, pauses: dict[str, int], seconds: float, **costs: float) -> None:
    """Each asker asks again after a page, and after so many ticks of 10 ms without one."""
    due = dict.fromkeys(pauses, 0)
    for tick in range(round(seconds * 100)):
        for name in [name for name in due if tick >= due[name]]:
            served = server.ask(name, costs.get(name, 0.1))
            due[name] = tick + (1 if served else pauses[name])
        server.now += 0.01


def test_one_that_asks_without_pause_gets_no_more_than_one_that_asks_four_times_a_second() -> None:
    server = Server()
    run(server, {"greedy": 1, "polite": 25}, 60.0)
    assert 0.9 < server.served["greedy"] / server.served["polite"] < 1.1
    assert sum(server.served.values()) > 0.7 * 60.0, "the rate is used"


def test_dear_pages_count_for_what_they_take() -> None:
    server = Server()
    run(server, {"dear": 25, "cheap": 25}, 120.0, dear=0.4, cheap=0.1)
    assert 0.8 < server.served["dear"] / server.served["cheap"] < 1.25


def test_one_that_asks_no_more_holds_nobody_up_and_one_that_begins_does_not_take_all() -> None:
    server = Server()
    run(server, {"first": 1, "second": 25}, 30.0)
    server.now += WAITS / 2
    before = server.served["first"]
    run(server, {"first": 1}, 30.0)
    assert server.served["first"] - before > 25.0
    before = server.served["first"]
    run(server, {"first": 1, "third": 25}, 30.0)
    assert 0.8 < server.served["third"] / (server.served["first"] - before) < 1.25


@pytest.mark.nightly
@given(st.lists(st.tuples(st.text(max_size=3), st.floats(0.0, 0.5)), max_size=200))
def test_names_without_end_cost_a_bounded_memory_and_somebody_is_served(
    asked: list[tuple[str, float]],
) -> None:
    shares, now = Shares(), 0.0
    for name, pause in asked:
        now += pause
        if shares.admits(name, now):
            shares.served(name, 0.1, now)
        assert len(shares._askers) <= MOST_ASKERS + 1
    names = {name for name, _ in asked} | {"another"}
    assert any(shares.admits(name, now) for name in names)

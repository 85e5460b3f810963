"""Rigs of one process take turns in one thread, and what they send leaves together."""

import contextlib
import threading
import time
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import pytest

from rigwatch.wire.bus.several.burst import Burst
from rigwatch.wire.host.turns import PART, Turns
from tests.waiting import eventually


class Rig:
    """Steps in turns, called from a thread of its own as a rig's acquisition does."""

    def __init__(self, turns: Turns, fails: bool = False) -> None:
        self.steps, self.threads, self.error = 0, set[int](), ""
        self.goes_on, self._fails = True, fails
        self.thread = threading.Thread(target=self._run, args=[turns], daemon=True)
        self.thread.start()

    def _run(self, turns: Turns) -> None:
        try:
            turns.serve(self._step)
        except OSError as error:
            self.error = str(error)

    def _step(self) -> bool:
        self.steps += 1
        self.threads.add(threading.get_ident())
        if self._fails:
            raise OSError("unplugged")
        return self.goes_on


def test_open_devices_are_read_in_one_thread_and_one_that_ends_or_fails_ends_alone() -> None:
    turns = Turns(0.001, contextlib.nullcontext)
    rigs = [Rig(turns), Rig(turns), Rig(turns, fails=True)]
    eventually(lambda: all(rig.steps >= 5 for rig in rigs[:2]), "turns of both")
    rigs[2].thread.join(60.0)
    assert rigs[2].error == "unplugged"
    assert rigs[2].steps == 1
    rigs[0].goes_on = False
    rigs[0].thread.join(60.0)
    before = rigs[1].steps
    eventually(lambda: rigs[1].steps > before + 5, "the other goes on")
    assert len(rigs[0].threads | rigs[1].threads) == 1
    rigs[1].goes_on = False
    rigs[1].thread.join(60.0)
    again = Rig(turns)
    eventually(lambda: again.steps >= 5, "turns begin again after a pause")
    again.goes_on = False
    again.thread.join(60.0)
    assert not again.thread.is_alive()


def test_what_is_done_with_all_rigs_of_a_part_comes_before_their_steps() -> None:
    seen: list[list[str]] = []
    fails = threading.Event()

    def before(subjects: Sequence[str]) -> None:
        seen.append(sorted(subjects))
        if fails.is_set():
            raise OSError("no table")

    turns = Turns(0.001, contextlib.nullcontext, before=before)
    steps, errors = Counter[str](), list[str]()

    def step(name: str) -> bool:
        steps[name] += 1
        return True

    def served(name: str) -> None:
        try:
            turns.serve(lambda: step(name), name)
        except OSError as error:
            errors.append(f"{name}: {error}")

    rigs = [threading.Thread(target=served, args=[name], daemon=True) for name in "ab"]
    for rig in rigs:
        rig.start()
    eventually(lambda: seen[-1:] == [["a", "b"]] and min(steps["a"], steps["b"]) > 5, "turns")
    assert len(seen) >= max(steps.values())
    fails.set()
    for rig in rigs:
        rig.join(60.0)
    assert sorted(errors) == ["a: no table", "b: no table"]


class Clock:
    """Time that passes only while something waits for it, or takes it."""

    def __init__(self) -> None:
        self.now = 0.0

    def sleep(self, seconds: float) -> None:
        self.now = round(self.now + seconds, 9)
        time.sleep(1e-4)


def steps_in_turns(turn: float, rigs: int, takes: float = 0.0) -> list[tuple[float, int]]:
    """Time and rig of some thousand steps, once all rigs are served; each step takes a time [s]."""
    clock, steps, ends = Clock(), list[tuple[float, int]](), threading.Event()
    turns = Turns(turn, contextlib.nullcontext, lambda: clock.now, clock.sleep)

    def step(rig: int) -> bool:
        steps.append((clock.now, rig))
        clock.now = round(clock.now + takes, 9)
        return not ends.is_set()

    threads = [
        threading.Thread(target=turns.serve, args=[lambda rig=rig: step(rig)])
        for rig in range(rigs)
    ]
    for thread in threads:
        thread.start()
    eventually(lambda: len({rig for _, rig in steps}) == rigs, "all rigs")
    first = len(steps)
    eventually(lambda: len(steps) > first + 1000, "turns of all")
    found = steps[first : first + 1000]
    ends.set()
    for thread in threads:
        thread.join(60.0)
    return found


def test_many_rigs_are_read_in_parts_of_a_turn_so_that_none_waits_for_all_others() -> None:
    steps = steps_in_turns(0.04, 2 * PART)
    at = sorted(Counter(now for now, _ in steps).items())[2:-2]
    assert {count for _, count in at} == {PART}
    assert {round(b - a, 6) for (a, _), (b, _) in pairwise(at)} == {0.02}


def test_few_rigs_are_read_together() -> None:
    steps = steps_in_turns(0.04, PART - 1)
    at = sorted(Counter(now for now, _ in steps).items())[2:-2]
    assert {count for _, count in at} == {PART - 1}


def test_no_rig_misses_its_turn_where_a_turn_takes_too_long() -> None:
    steps = steps_in_turns(0.04, 4 * PART, takes=0.002)
    taken = Counter(rig for _, rig in steps)
    assert max(taken.values()) - min(taken.values()) <= 2
    times = [now for now, _ in steps]
    assert max(b - a for a, b in pairwise(times)) < 0.01


def test_what_is_sent_in_a_turn_leaves_in_order_at_its_end() -> None:
    burst, sent = Burst(), list[int]()
    with burst.held():
        for number in range(3):
            burst.add(lambda number=number: sent.append(number))
    assert sent == [0, 1, 2]
    burst.close()


def test_what_waits_for_too_long_leaves_before_a_long_turn_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("rigwatch.wire.bus.several.burst.GATHER", 0.0)
    burst, sent = Burst(), list[int]()
    with burst.held():
        burst.add(lambda: sent.append(0))
        eventually(lambda: burst.add(lambda: sent.append(1)) or bool(sent), "the first")
        assert sent[0] == 0
    burst.close()


def test_what_is_sent_outside_of_turns_leaves_by_itself_and_the_rest_at_the_end() -> None:
    burst, sent = Burst(), list[int]()
    burst.add(lambda: sent.append(0))
    eventually(lambda: sent == [0], "the first")
    burst.add(lambda: sent.append(1))
    burst.close()
    assert sent == [0, 1]
    burst.add(lambda: sent.append(2))
    burst.send()
    assert sent == [0, 1, 2]

"""Rigs in threads of one process: one that hangs or fails delays none and is reported."""

import threading
import time
from collections.abc import Callable, Iterator

import pytest

from rigwatch.wire.host import Heartbeat, Part, RigPulse, run_side_by_side, side_by_side
from tests.waiting import eventually


def counting(stop: threading.Event, pulse: RigPulse) -> None:
    pulse.ready()
    count = 0
    while not stop.wait(0.001):
        count += 1
        pulse.advance(count)
    pulse.stopping()


class Running:
    """Parts under their loop, in a thread."""

    def __init__(self) -> None:
        self.said: list[str] = []
        self.stop, self.renew = threading.Event(), threading.Event()
        self.versions: dict[str, int] = {}
        self.parts: list[Part] = []

    def start(self, **works: Callable[[threading.Event, RigPulse], None]) -> list[Part]:
        self.parts = [
            Part(name, work, lambda n=name: self.versions.get(n), self.said.append)
            for name, work in works.items()
        ]
        loop = (self.parts, Heartbeat("daq", {}), self.stop, self.renew)
        self.thread = threading.Thread(target=run_side_by_side, args=loop)
        self.thread.start()
        return self.parts

    def go_on(self, part: Part) -> None:
        wanted = part.count + 20
        eventually(lambda: part.count >= wanted, "samples of a rig")


@pytest.fixture
def running() -> Iterator[Running]:
    made = Running()
    yield made
    made.stop.set()
    made.thread.join()


def test_one_that_hangs_is_reported_and_delays_none(running, monkeypatch):
    monkeypatch.setattr(side_by_side, "HANGS_AFTER", 0.2)
    let = threading.Event()

    def hanging(stop: threading.Event, pulse: RigPulse) -> None:
        pulse.ready()
        let.wait()
        counting(stop, pulse)

    healthy, hung = running.start(a=counting, b=hanging)
    eventually(lambda: running.said == ["b: hangs: no turn for 0.2 s"], "the hanging rig is named")
    running.go_on(healthy)
    assert hung.count == 0
    let.set()
    running.go_on(hung)
    eventually(lambda: running.said[1:] == ["b: goes on"], "that it goes on")


def test_one_that_fails_starts_anew_and_keeps_its_count(running, monkeypatch):
    monkeypatch.setattr(side_by_side, "FIRST_PAUSE", 0.01)
    breaks, runs = threading.Event(), []

    def failing(stop: threading.Event, pulse: RigPulse) -> None:
        runs.append(1)
        if len(runs) == 1:
            pulse.advance(100)
            breaks.wait()
            raise OSError("the device\nis gone")
        counting(stop, pulse)

    healthy, failed = running.start(a=counting, b=failing)
    running.go_on(healthy)
    breaks.set()
    eventually(lambda: failed.count > 120, "the rig goes on")
    running.go_on(healthy)
    assert running.said == ["b: the device is gone; starts anew in 0 s"]


def test_a_process_is_not_ready_while_its_rigs_begin_one_after_the_other(running, monkeypatch):
    monkeypatch.setattr(side_by_side, "START_PATIENCE", 0.5)
    ready_at: list[float] = []
    monkeypatch.setattr(Heartbeat, "ready", lambda *_: ready_at.append(time.monotonic()))

    def begins_after(pause: float) -> Callable[[threading.Event, RigPulse], None]:
        return lambda stop, pulse: time.sleep(pause) or counting(stop, pulse)

    began = time.monotonic()
    running.start(a=begins_after(0.3), b=begins_after(0.6), c=begins_after(0.9))
    eventually(lambda: ready_at != [], "the process is ready")
    assert ready_at[0] - began >= 0.9


def test_a_process_is_ready_beside_a_rig_that_never_begins(running, monkeypatch):
    monkeypatch.setattr(side_by_side, "START_PATIENCE", 0.2)
    ready = threading.Event()
    monkeypatch.setattr(Heartbeat, "ready", lambda *_: ready.set())
    held = threading.Event()
    running.start(a=counting, b=lambda _stop, _pulse: held.wait() and None)
    assert ready.wait(10.0)
    held.set()


def test_the_process_ends_beside_a_rig_that_never_ends(running, monkeypatch):
    monkeypatch.setattr(side_by_side, "STOP_PATIENCE", 0.05)
    held = threading.Event()
    healthy, _ = running.start(a=counting, b=lambda _stop, _pulse: held.wait() and None)
    running.go_on(healthy)
    running.stop.set()
    eventually(lambda: not running.thread.is_alive(), "the end of the loop")
    held.set()


def test_rigs_that_end_one_after_the_other_are_all_waited_for(running, monkeypatch):
    monkeypatch.setattr(side_by_side, "STOP_PATIENCE", 1.0)
    ends, ended = threading.Lock(), list[str]()

    def ends_slowly(name: str) -> Callable[[threading.Event, RigPulse], None]:
        def work(stop: threading.Event, pulse: RigPulse) -> None:
            counting(stop, pulse)
            with ends:  # as recordings do that close their files
                time.sleep(0.4)
                ended.append(name)

        return work

    parts = running.start(**{name: ends_slowly(name) for name in "abcdef"})
    for part in parts:
        running.go_on(part)
    running.stop.set()
    running.thread.join()
    assert sorted(ended) == [*"abcdef"]


def test_only_a_rig_whose_configuration_has_changed_starts_anew(running):
    runs: list[str] = []

    def noted(name: str) -> Callable[[threading.Event, RigPulse], None]:
        return lambda stop, pulse: runs.append(name) or counting(stop, pulse)

    first, second = running.start(a=noted("a"), b=noted("b"))
    running.go_on(first)
    running.go_on(second)
    running.versions["b"] = 2
    running.renew.set()
    eventually(lambda: len(runs) == 3, "a rig starts anew")
    running.go_on(first)
    running.go_on(second)
    assert sorted(runs) == ["a", "b", "b"]
    assert running.said == []

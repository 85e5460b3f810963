"""A process's word to its supervisor."""

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.supervisor import OwnHeartbeat, ProcessPlan, Supervisor
from rigwatch.supervisor.own_heartbeat import PATIENCE
from rigwatch.wire.host.heartbeat import INTERVAL, NO_ROUTER, WAITS, WAITS_AFTER, Heartbeat


@pytest.fixture
def supervisor(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.setblocking(False)
        yield listener


def said(listener: socket.socket) -> list[str]:
    words = []
    while True:
        try:
            words.append(listener.recv(4096).decode())
        except BlockingIOError:
            return words


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def heartbeat(listener: socket.socket, clock: Clock) -> Heartbeat:
    return Heartbeat("daq", {"NOTIFY_SOCKET": listener.getsockname()}, clock)


def test_watchdog_is_fed_only_while_samples_advance(supervisor: socket.socket) -> None:
    clock = Clock()
    beat = heartbeat(supervisor, clock)
    for count in (8, 16, 16, 16, 24):
        beat.advance(count)
        clock.now += INTERVAL
    fed = ["WATCHDOG=1" in word for word in said(supervisor)]
    assert fed == [True, True, False, False, True]


def test_words_are_limited_in_rate(supervisor: socket.socket) -> None:
    clock = Clock()
    beat = heartbeat(supervisor, clock)
    for count in range(1, 257):
        beat.advance(count)
        clock.now += 1 / 256
    assert len(said(supervisor)) == round(1 / INTERVAL)


def test_ready_status_and_stopping_are_systemds_words(supervisor: socket.socket) -> None:
    beat = heartbeat(supervisor, Clock())
    beat.ready("serial line open")
    beat.status("reconnecting")
    beat.stopping()
    first, second, third = said(supervisor)
    assert first.startswith("READY=1\nSTATUS=serial line open\n")
    assert (second, third) == ("STATUS=reconnecting", "STOPPING=1")


def test_a_process_that_was_started_by_hand_opens_no_socket(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    opened: list[object] = []
    monkeypatch.setattr(socket, "socket", lambda *kind: opened.append(kind))
    beat = Heartbeat("daq", {})
    beat.ready()
    beat.advance(1)
    beat.stopping()
    assert opened == []


def test_words_reach_a_supervisor_that_comes_later(tmp_path: Path) -> None:
    clock, place = Clock(), str(tmp_path / "notify")
    beat = Heartbeat("daq", {"NOTIFY_SOCKET": place}, clock)
    beat.ready()
    beat.advance(1)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(place)
        listener.setblocking(False)
        clock.now += INTERVAL
        beat.advance(3)
        beat.stopping()
        assert said(listener) == ["WATCHDOG=1\nX_RIGWATCH_COUNT=3", "STOPPING=1"]
    beat.stopping()


def test_a_full_socket_does_not_block(supervisor: socket.socket) -> None:
    clock = Clock()
    beat = heartbeat(supervisor, clock)
    for count in range(5000):
        beat.advance(count)
        clock.now += INTERVAL
    assert said(supervisor)


def test_what_a_late_supervisor_could_not_take_is_said_again(supervisor: socket.socket) -> None:
    clock = Clock()
    beat = heartbeat(supervisor, clock)
    for turn in range(10_000):  # nobody reads: the socket takes no more
        beat.advance(turn + 1)
        clock.now += INTERVAL
    clock.now += WAITS_AFTER
    beat.advance(10_000, "the device is not open")
    said(supervisor)
    clock.now += INTERVAL
    beat.advance(10_000, "the device is not open")
    assert f"STATUS={WAITS}the device is not open" in said(supervisor)[0]


def ready(supervisor: Supervisor, name: str) -> None:
    """What a process of this name reports that runs."""
    watched = supervisor.processes[name]
    watched.start_at, watched.was_ready = None, True
    watched.vitals.take("READY=1\nSTATUS=running", 0.0)


def supervised(*names: str) -> Supervisor:
    """Processes that have not been started."""
    made = Supervisor([ProcessPlan(name, ("false",)) for name in names], lambda _: None)
    for watched in made.processes.values():
        watched.start_at = 0.0
    return made


def test_a_process_that_does_not_get_ready_does_not_make_the_parent_start_all_anew(
    supervisor: socket.socket,
) -> None:
    clock, processes = Clock(), supervised("daq", "monitor")
    own = OwnHeartbeat(processes, heartbeat(supervisor, clock), clock)
    ready(processes, "daq")
    own.turn(0)
    clock.now = PATIENCE - 1.0
    own.turn(1)
    assert "READY" not in "".join(said(supervisor))
    clock.now = PATIENCE
    own.turn(2)
    assert said(supervisor)[0].startswith("READY=1\nSTATUS=all but monitor run")
    own.turn(3)
    assert "READY" not in "".join(said(supervisor))
    processes._stop_all()


@pytest.mark.parametrize(
    ("status", "told"),
    [
        (f"{WAITS}no device matches", "no device matches"),
        (f"{WAITS}{NO_ROUTER}", NO_ROUTER),
        ("running", ""),
        (None, "daq is down"),
        ("absent", "samples come from elsewhere"),
    ],
)
def test_the_parent_is_told_why_no_samples_come(
    status: str | None, told: str, supervisor: socket.socket
) -> None:
    clock, processes = Clock(), supervised("daq" if status != "absent" else "recorder")
    own = OwnHeartbeat(processes, heartbeat(supervisor, clock), clock)
    if status not in (None, "absent"):
        ready(processes, "daq")
        processes.processes["daq"].vitals.take(f"STATUS={status}", 0.0)
    own.turn(5)
    clock.now = WAITS_AFTER
    said(supervisor)
    own.turn(5)
    (word,) = said(supervisor)
    assert ("WATCHDOG=1" in word) == bool(told)
    assert (f"STATUS={WAITS}{told}" in word) == bool(told)
    processes._stop_all()

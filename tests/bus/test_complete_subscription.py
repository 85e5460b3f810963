"""Alarms and estimates reach every listener once: through loss, restarts, and a killed router."""

import signal
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.bus import Bus, complete_subscription, sender
from rigwatch.wire.bus.alarms.shares import STRANGERS_SHARE
from rigwatch.wire.bus.complete_subscription import MOST_SENDERS
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.bus.message_ring import REPLY_BYTES, MessageRing
from rigwatch.wire.bus.ring_questions import RingQuestions
from rigwatch.wire.bus.subscription import Subscription
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    GAPS,
    Alarm,
    Column,
    EstimateBlock,
    Gap,
    encode,
    remember,
)
from rigwatch.wire.ordering import OPEN, Ask, Numbered, RingReply
from tests.bus.rig import TestRig, answers, kill
from tests.waiting import PATIENCE, eventually, wait_until


def alarm(seq: int) -> Alarm:
    return Alarm("gap", "normal", "info", "", "", "rig", 7, seq, 5, 0.0, 0.0, 0.0, False, "", seq)


def say(bus: Bus, seqs: range) -> None:
    for seq in seqs:
        bus.publish(ALARMS, alarm(seq))


def heard(subscription: Subscription, until: int) -> list[int]:
    """Numbers of the alarms up to the one called `until`."""
    found: list[int] = []

    def complete() -> bool:
        found.extend(message.seq for message in subscription.drain())
        return bool(found) and found[-1] >= until

    assert wait_until(complete, PATIENCE, 0.005), found
    return found


def test_what_is_lost_on_the_way_is_fetched_once_and_in_order():
    network = MemoryNetwork()
    monitor, listener = network.bus("r", "monitor"), network.bus("r", "listener").subscribe(ALARMS)
    say(monitor, range(3))
    network.up = False
    say(monitor, range(3, 60))
    network.up = True
    say(monitor, range(60, 62))
    assert heard(listener, 61) == list(range(62))


def test_what_takes_many_answers_of_the_ring_is_caught_up_with_in_one_call():
    network = MemoryNetwork()
    monitor, listener = network.bus("r", "monitor"), network.bus("r", "listener").listen(ALARMS)
    network.up = False
    said = range(6 * REPLY_BYTES // len(encode(alarm(0))))
    say(monitor, said)
    network.up = True
    found = [message.seq for message in listener.drain()]
    assert not found, "no answer has been asked for yet"
    say(monitor, range(said.stop, said.stop + 1))

    def begun() -> bool:
        found.extend(message.seq for message in listener.catch_up(PATIENCE))
        return bool(found)

    eventually(begun, "the first answer")
    assert found == list(range(said.stop + 1))


class Listening:
    """A subscription to which messages are handed, and what it asks rings for."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, quick: bool) -> None:
        self.asked: list[Ask] = []
        self.of = MemoryNetwork().bus("r", "listener").listen(ESTIMATES)
        self.quickly = 0
        monkeypatch.setattr(self.of._questions, "ask", lambda _, ask: self.asked.append(ask))
        if not quick:
            monkeypatch.setattr(self.of, "_took_run", lambda _: False)

    def take(self, waiting: list[tuple[object, ...]]) -> None:
        if self.of._took_run(waiting):
            self.quickly += 1
            return
        for one in waiting:
            self.of._take(one)

    def stands(self) -> tuple[object, ...]:
        of = self.of
        return [*of._ready], of.foreign, of.rejected, of.positions(), self.asked


def test_messages_that_wait_together_are_taken_as_one_by_one(monkeypatch) -> None:
    """Some are lost, twice there, a stranger's, of another run, or with a mark that is none."""
    random, run, since, number = np.random.default_rng(3), 7, 5, -1
    quick, alone = Listening(monkeypatch, quick=True), Listening(monkeypatch, quick=False)
    fates = ["", "lost", "again", "strange", "unknown run", "no mark", "another run"]
    for turn in range(3000):
        waiting: list[tuple[object, ...]] = []
        if turn == 0:
            waiting.append(("monitor", ("monitor", run, since, "id"), True, True))
        for _ in range(int(random.integers(1, 12))):
            fate = random.choice(fates, p=[0.985, *[0.0025] * 6])
            number += {"lost": 2, "again": 0}.get(fate, 1)
            if fate == "another run":
                waiting.append(("monitor", ("monitor", run, since, "id"), False, True))
                run, since, number = run + 1, since + 1, 0
                waiting.append(("monitor", ("monitor", run, since, "id"), True, True))
            of = Numbered(9999 if fate == "unknown run" else run, number, b"%d" % turn)
            mark = b"1" if fate == "no mark" else of.mark
            waiting.append((of.payload, "other" if fate == "strange" else "id", mark))
        for listener in (quick, alone):
            listener.take(waiting)
        assert quick.stands() == alone.stands(), turn
        for listener in (quick, alone):
            listener.of._ready.clear()
            if listener.asked:  # which the ring does not have
                ask = listener.asked.pop()
                settled = ask.first - 1 if ask.last == OPEN else ask.last
                reply = RingReply(ask.boot, settled, ()).to_bytes()
                listener.of._take(("monitor", ask, [reply], None))
    assert quick.quickly > 1000
    assert quick.of.foreign > 10
    assert quick.of.rejected > 10


@pytest.mark.parametrize(
    ("patient", "expected"),
    [(False, [0.5, 1.0, 1.5, 2.0, 2.5]), (True, [0.5, 1.5, 3.5, 7.5, 15.5, 31.5, 47.5])],
)
def test_the_longer_nothing_comes_the_less_often_a_patient_reader_asks(
    monkeypatch, patient: bool, expected: list[float]
) -> None:
    now, asked = 0.0, list[float]()
    monkeypatch.setattr(complete_subscription.time, "monotonic", lambda: now)
    network = MemoryNetwork()
    monitor = network.bus("r", "monitor")
    monitor.announce()
    listener = network.bus("r", "listener").listen(ALARMS, patient=patient)
    listener._took(0.0)
    (peer,) = listener._senders.values()
    monkeypatch.setattr(peer, "silent", lambda: asked.append(now) or [])

    def asked_in_silence() -> list[float]:
        nonlocal now
        asked.clear()
        begin = now
        while len(asked) < len(expected):
            now += 0.125
            listener._look_for_more()
        return [at - begin for at in asked]

    assert asked_in_silence() == expected
    say(monitor, range(1))
    listener._took(0.0)
    assert asked_in_silence() == expected


def test_estimates_that_wait_together_are_one_block_up_to_a_gap_and_invalid_ones_are_counted():
    network = MemoryNetwork()
    monitor = network.bus("r", "monitor")
    listener = network.bus("r", "listener").listen(ESTIMATES, gaps_in_place=True)

    def publish(seqs: range) -> None:
        for seq in seqs:
            values = np.array([seq, -seq], float)
            times = 2 * seq + np.array([3, 4])
            block = EstimateBlock("rig", 7, 2 * seq, times, (Column("x", "", values),))
            monitor.publish(ESTIMATES, block)

    publish(range(3))
    monitor._numbered().put(ESTIMATES, b"no estimates")
    publish(range(3, 5))
    publish(range(6, 8))
    listener._ready.append(gap := Gap("monitor", 1, 2, 3, 4, "listener", "lost", "estimates"))
    found = []
    eventually(lambda: found.extend(listener.catch_up(0.0)) or len(found) == 4, "all")
    before, first, second, third = found
    assert before is gap
    assert [first.seq, len(first)] == [0, 6]
    assert [second.seq, len(second)] == [6, 4]
    assert [third.seq, len(third)] == [12, 4]
    assert first.column("x").values.tolist() == [0, 0, 1, -1, 2, -2]
    assert listener.rejected == 1


def test_the_last_word_before_a_silence_is_received_too():
    network = MemoryNetwork()
    monitor, listener = network.bus("r", "monitor"), network.bus("r", "listener").subscribe(ALARMS)
    say(monitor, range(2))
    network.up = False
    say(monitor, range(2, 4))
    network.up = True
    assert heard(listener, 3) == [0, 1, 2, 3]


def test_a_late_listener_gets_messages_from_then_on():
    network = MemoryNetwork()
    monitor = network.bus("r", "monitor")
    say(monitor, range(5))
    listener = network.bus("r", "listener").subscribe(ALARMS)
    network.up = False
    say(monitor, range(5, 6))
    network.up = True
    assert heard(listener, 5) == [5]


def test_a_listener_that_begins_while_the_router_is_gone_gets_no_old_messages():
    network = MemoryNetwork()
    monitor = network.bus("r", "monitor")
    say(monitor, range(5))
    hidden, network.tokens, network.up = network.tokens, [], False
    listener = network.bus("r", "listener").subscribe(ALARMS)
    network.tokens, network.up = hidden, True
    for token in hidden:
        network.tell(token, True)
    say(monitor, range(5, 7))
    assert heard(listener, 6) == [5, 6]


def test_a_ring_that_is_slow_to_say_where_it_is_delays_no_reader(monkeypatch: pytest.MonkeyPatch):
    network = MemoryNetwork()
    monitor, reader = network.bus("r", "monitor"), network.bus("r", "listener")
    say(monitor, range(5))
    hidden, network.tokens, network.up = network.tokens, [], False
    listener = reader.subscribe(ALARMS)
    network.tokens, network.up = hidden, True
    answers, query = threading.Event(), reader.query

    def slow(key: str, question: bytes = b"", timeout: float = 1.0) -> list[bytes]:
        answers.wait(PATIENCE)
        return query(key, question, timeout)

    monkeypatch.setattr(reader, "query", slow)
    for token in hidden:
        network.tell(token, True)
    looked = threading.Event()
    # A second, as names of tokens are learnt in another thread.
    threading.Thread(target=lambda: (_look_for(listener, 1.0), looked.set()), daemon=True).start()
    assert looked.wait(PATIENCE / 4), "the reader waits for the ring"
    say(monitor, range(5, 7))
    answers.set()
    assert heard(listener, 6) == [5, 6]


def _look_for(listener: Subscription, seconds: float) -> None:
    """Look for messages again and again, of which none come."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        assert listener.drain() == []
        time.sleep(0.01)


def test_messages_of_a_restarted_process_arrive_from_the_first_on_and_the_break_is_reported():
    network = MemoryNetwork()
    gaps = network.bus("r", "observer").subscribe(GAPS)
    listener = network.bus("r", "listener").subscribe(ALARMS)
    first = network.bus("r", "monitor")
    say(first, range(4))
    first.close()
    second = network.bus("r", "monitor")
    network.up = False
    say(second, range(10, 12))
    network.up = True
    assert heard(listener, 11) == [0, 1, 2, 3, 10, 11]
    told = gaps.drain()
    assert [(gap.topic, gap.device, gap.last - gap.first + 1) for gap in told] == [
        ("alarms", "monitor", 0)
    ]


def test_a_listener_started_again_hears_all_of_a_process_that_began_meanwhile() -> None:
    network = MemoryNetwork()
    monitor = network.bus("r", "monitor")
    say(monitor, range(2))
    first = network.bus("r", "listener").listen(ALARMS)
    say(monitor, range(2, 3))
    assert heard(first, 2) == [2]
    first.close()
    say(monitor, range(3, 5))
    say(network.bus("r", "witness"), range(10, 12))
    again = network.bus("r", "listener").listen(ALARMS, first.positions())
    found: set[int] = set()

    def complete() -> bool:
        found.update(message.seq for message in again.drain())
        return len(found) >= 4

    eventually(complete, "all of both processes")
    assert found == {3, 4, 10, 11}


def test_what_an_ended_process_said_to_nobody_is_a_gap_once_its_successor_is_there() -> None:
    network = MemoryNetwork()
    gaps = network.bus("r", "observer").subscribe(GAPS)
    listener = network.bus("r", "listener").subscribe(ALARMS)
    first = network.bus("r", "witness")
    first.announce()
    network.up = False
    say(first, range(1))
    first.close()
    network.up = True
    network.bus("r", "witness").announce()
    told: list[tuple[str, str, int]] = []

    def reported() -> bool:
        assert not listener.drain()
        told.extend((gap.topic, gap.device, gap.first) for gap in gaps.drain())
        return bool(told)

    eventually(reported, "a report of the gap")
    assert told == [("alarms", "witness", 0)]


def test_two_processes_that_say_alarms_are_both_heard():
    network = MemoryNetwork()
    listener = network.bus("r", "listener").subscribe(ALARMS)
    say(network.bus("r", "monitor"), range(3))
    say(network.bus("r", "structure"), range(100, 103))
    assert sorted(heard(listener, 102)) == [0, 1, 2, 100, 101, 102]


def test_an_alarm_in_the_name_of_another_is_dropped_and_counted():
    network = MemoryNetwork()
    monitor, stranger = network.bus("r", "monitor"), network.bus("r", "stranger")
    listener = network.bus("r", "listener").listen(ALARMS)
    say(monitor, range(1))
    key, payload = monitor.key(ALARMS.key), encode(alarm(666))
    assert monitor._outlet is not None
    for mark in (Numbered(monitor._outlet.run, 1, b"").mark, Numbered(99, 0, b"").mark, b"", b"x"):
        stranger.transport.put(key, payload, mark)
    say(monitor, range(1, 3))
    assert heard(listener, 2) == [0, 1, 2]
    assert (listener.foreign, listener.rejected) == (2, 2)


def test_no_number_of_made_up_alarms_pushes_a_real_one_out() -> None:
    network = MemoryNetwork()
    strangers = [network.bus("r", f"stranger{number}") for number in range(20)]
    monitor = network.bus("r", "monitor")
    listener = network.bus("r", "listener").listen(ALARMS)
    known: dict[str, Alarm] = {}

    def said(bus: Bus, name: str) -> None:
        standing = replace(alarm(0), name=name, state="unacknowledged", severity="critical")
        bus.publish(ALARMS, standing)

    said(monitor, "dry_friction")
    for number in range(3000):
        said(strangers[number % 20], f"made up {number}")
    said(monitor, "stale")
    for one in listener.drain():
        remember(known, one)
    assert {"dry_friction", "stale"} <= known.keys()
    assert len(known) <= 2 + MOST_SENDERS * STRANGERS_SHARE
    assert listener.foreign > 2000
    assert {one.code for one in listener.reports()} == {"ALARMS REFUSED"}


def test_what_a_process_said_is_heard_though_its_end_came_first(monkeypatch: pytest.MonkeyPatch):
    network = MemoryNetwork()
    monitor, stranger = network.bus("r", "monitor"), network.bus("r", "stranger")
    listener = network.bus("r", "listener").listen(ALARMS)
    say(monitor, range(2))
    assert monitor._outlet is not None
    monitor._outlet._token.close()  # its end overtakes what follows
    key, run = monitor.key(ALARMS.key), monitor._outlet.run
    for number in (1, 2, 10**9):
        stranger.transport.put(key, encode(alarm(666)), Numbered(run, number, b"").mark)
    say(monitor, range(2, 4))
    monitor.transport.put(key, encode(alarm(3)), Numbered(run, 3, b"").mark)
    assert heard(listener, 3) == [0, 1, 2, 3]
    assert (listener.foreign, listener.lost) == (3, 0)
    monkeypatch.setattr(sender, "LATE", 0.0)
    say(monitor, range(4, 6))
    assert not listener.drain()
    assert listener.foreign == 5


def test_the_only_word_of_a_process_is_heard_though_its_end_came_first():
    network = MemoryNetwork()
    listener = network.bus("r", "listener").listen(ALARMS)
    monitor = network.bus("r", "monitor")
    monitor.announce()
    assert monitor._outlet is not None
    monitor._outlet._token.close()
    network.servers.clear()  # its ring has ended, too
    say(monitor, range(1))
    assert heard(listener, 0) == [0]


def test_what_the_ring_no_longer_has_is_counted_and_reported():
    ring = MessageRing(7, capacity=1000)
    for _ in range(50):
        ring.add(b"x" * 100)
    reply = ring.reply(Ask(7, 10, OPEN))
    assert [message.seq for message in reply.blocks] == list(range(40, 50))
    assert reply.settled == 49
    assert ring.reply(Ask(8, 0, OPEN)).settled == -1

    network = MemoryNetwork()
    monitor, listening = network.bus("r", "monitor"), network.bus("r", "listener")
    say(monitor, range(1))
    listener = listening.listen(ALARMS)
    assert monitor._outlet is not None
    monitor._outlet._rings[ALARMS.name]._capacity = 5 * len(encode(alarm(1))) + 9
    network.up = False
    say(monitor, range(1, 40))
    network.up = True
    say(monitor, range(40, 41))
    assert heard(listener, 40) == list(range(36, 41))
    assert listener.lost == 35
    (report,) = listener.reports()
    assert (report.first, report.last, report.topic) == (1, 35, "alarms")


def test_alarms_said_while_the_router_was_away_reach_every_listener_once(tmp_path: Path):
    with TestRig(tmp_path) as rig:
        router = rig.router()
        monitor = rig.bus("monitor")
        say(monitor, range(1))
        one, other = (rig.bus(name).subscribe(ALARMS) for name in ("one", "other"))
        say(monitor, range(1, 3))
        assert [heard(listener, 2) for listener in (one, other)] == [[1, 2]] * 2
        router.send_signal(signal.SIGKILL)
        router.wait()
        eventually(lambda: not monitor.connected(), "the router is missed")
        say(monitor, range(3, 40))
        again = rig.router()
        eventually(lambda: answers(rig.listen), "the router is back")
        assert [heard(listener, 39) for listener in (one, other)] == [list(range(3, 40))] * 2
        say(monitor, range(40, 42))
        assert [heard(listener, 41) for listener in (one, other)] == [[40, 41]] * 2
        assert one.lost == other.lost == 0
        kill(again)


def test_no_thread_asks_any_more_once_the_bus_is_closed(tmp_path: Path):
    """An interpreter that ends while a thread waits for a reply aborts."""
    asked, done = threading.Event(), threading.Event()

    def keep_waiting(_: bytes) -> list[bytes]:
        asked.set()
        done.wait(PATIENCE)
        return []

    with TestRig(tmp_path) as rig:
        rig.router()
        rig.bus("slow").serve("slow", keep_waiting)
        before = threading.enumerate()
        bus = rig.bus("asks")
        questions = RingQuestions(bus, lambda *_: None)
        questions.ask("slow", Ask(1, 0, 0))
        assert asked.wait(PATIENCE)
        assert not set(threading.enumerate()) <= set(before)
        bus.close()
        assert set(threading.enumerate()) <= set(before)
        done.set()

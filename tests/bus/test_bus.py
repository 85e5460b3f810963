"""The bus, over Zenoh and in memory: one behaviour."""

import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.connection import connect
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.bus.subscription import Subscription
from rigwatch.wire.bus.transport import MAX_PAYLOAD
from rigwatch.wire.bus.zenoh_transport import open_router
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages.message_types import Event
from rigwatch.wire.messages.protobuf import encode
from rigwatch.wire.messages.topics import EVENTS, SAMPLES
from rigwatch.wire.rig_config import load_rig
from tests.bus.rig import TestRig, stopped
from tests.bus.samples import block, is_intact
from tests.waiting import PATIENCE, eventually

Join = Callable[[str], Bus]


@pytest.fixture(scope="module")
def zenoh_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestRig]:
    with TestRig(tmp_path_factory.mktemp("rig")) as rig:
        close = open_router(rig.config.bus.listen)
        yield rig
        close()


@pytest.fixture(params=["zenoh", "memory"])
def join(request: pytest.FixtureRequest) -> Iterator[Join]:
    """Makes places on one bus, and closes them."""
    made: list[Bus] = []
    network = MemoryNetwork()
    rig = request.getfixturevalue("zenoh_rig") if request.param == "zenoh" else None

    def place(process: str) -> Bus:
        bus = rig.bus(process) if rig else network.bus("bench", process)
        made.append(bus)
        return bus

    yield place
    for bus in made:
        bus.close()


def event(text: str = "") -> Event:
    return Event("test", 1, "info", "TEST", text)


def until_heard(publisher: Bus, subscription: Subscription) -> None:
    """Publish until the subscription is known to the publisher; then forget what came."""

    def heard() -> bool:
        publisher.publish(EVENTS, event("are you there"))
        return subscription.get(timeout=0.05) is not None

    eventually(heard, "a subscription is heard of")
    while subscription.get(timeout=0.2) is not None:
        pass


def test_messages_arrive_whole_and_in_order(join: Join) -> None:
    sender, subscription = join("sender"), join("reader").subscribe(EVENTS)
    until_heard(sender, subscription)
    for number in range(100):
        sender.publish(EVENTS, event(str(number)))
    got = [subscription.get(timeout=PATIENCE) for _ in range(100)]
    assert [message.text for message in got] == [str(number) for number in range(100)]
    assert subscription.get(timeout=0) is None
    assert subscription.dropped == subscription.rejected == 0


def test_samples_survive_the_journey(join: Join) -> None:
    sender, reader = join("sender"), join("reader")
    samples, events = reader.subscribe(SAMPLES), reader.subscribe(EVENTS)
    until_heard(sender, events)
    sender.publish(SAMPLES, block(17, 40, boot=3))
    got = samples.get(timeout=PATIENCE)
    assert (got.boot, got.seq, len(got)) == (3, 17, 40)
    assert is_intact(got)


def test_malformed_and_oversized_payloads_are_counted_and_hurt_nobody(join: Join) -> None:
    sender, subscription = join("sender"), join("reader").subscribe(EVENTS)
    until_heard(sender, subscription)
    key = sender.key(EVENTS.key)
    sender.transport.put(key, b"\xff" * 100)
    sender.transport.put(key, b"\xff" * (MAX_PAYLOAD + 1000))
    sender.publish(EVENTS, event("after"))
    assert subscription.get(timeout=PATIENCE).text == "after"
    assert subscription.rejected == 1, "the oversized one must not even arrive"


def test_an_oversized_message_is_refused_by_its_sender(join: Join) -> None:
    with pytest.raises(BusError, match="expected at most"):
        join("sender").publish(EVENTS, event("x" * MAX_PAYLOAD))


def test_a_slow_reader_loses_the_oldest_and_knows_how_many(join: Join) -> None:
    reader = join("reader")
    slow, fast = reader.subscribe(EVENTS, capacity=10), reader.subscribe(EVENTS)
    sender = join("sender")
    until_heard(sender, fast)
    slow.drain()
    before = slow.dropped
    for number in range(50):
        sender.publish(EVENTS, event(str(number)))
    eventually(lambda: len(fast) == 50, "all messages arrived")
    assert [message.text for message in slow.drain()] == [str(n) for n in range(40, 50)]
    assert slow.dropped - before == 40


def test_a_closed_subscription_hears_no_more(join: Join) -> None:
    sender, reader = join("sender"), join("reader")
    closed, other = reader.subscribe(EVENTS), reader.subscribe(EVENTS)
    until_heard(sender, other)
    closed.drain()
    closed.close()
    closed.close()
    sender.publish(EVENTS, event())
    assert other.get(timeout=PATIENCE) is not None
    assert len(closed) == 0


def test_questions_reach_all_who_serve_and_failures_are_no_reply(join: Join) -> None:
    asker, first, second, broken = (join(name) for name in ("asker", "first", "second", "broken"))
    first.serve("echo", lambda question: [question, question * 2])
    second.serve("echo", lambda _: [b"second"])

    def fails(_: bytes) -> list[bytes]:
        raise ValueError("broken")

    broken.serve("echo", fails)
    eventually(
        lambda: sorted(asker.query("echo", b"a")) == [b"a", b"aa", b"second"], "all have replied"
    )
    assert asker.query("nobody") == []


def test_tokens_show_who_is_alive(join: Join) -> None:
    watcher = join("watcher")
    seen: list[tuple[str, bool]] = []
    watcher.watch_tokens("alive/*", lambda key, alive: seen.append((key, alive)))
    worker = join("worker")
    close = worker.declare_token("alive/part")
    eventually(lambda: ("alive/part", True) in seen, "the token is seen")
    there = {"alive/watcher", "alive/worker", "alive/part"}
    eventually(lambda: there <= set(watcher.tokens("alive/*")), "all three are alive")
    close()
    eventually(lambda: ("alive/part", False) in seen, "the token's end is seen")
    worker.close()
    eventually(lambda: ("alive/worker", False) in seen, "the process's end is seen")
    assert watcher.tokens("alive/worker") == []


def test_a_question_is_answered_by_the_memory_of_a_reader_that_has_closed_no_more() -> None:
    network = MemoryNetwork()
    server, asker = network.bus("bench", "server"), network.bus("bench", "asker")
    server.serve("q", lambda _: [b"yes"])
    assert asker.query("q") == [b"yes"]
    server.close()
    assert asker.query("q") == []


@settings(deadline=None)
@given(payload=st.binary(max_size=200))
def test_no_payload_makes_a_subscription_raise(payload: bytes) -> None:
    subscription = Subscription(SAMPLES)
    subscription.receive(payload)
    good = block(3)
    subscription.receive(encode(good))
    got = subscription.drain()
    assert got[-1].seq == 3
    assert subscription.rejected + len(got) == 2


def test_without_a_router_the_endpoint_is_named(tmp_path: Path) -> None:
    config = TestRig(tmp_path).config
    with pytest.raises(BusError, match=f"no router answers at {config.bus.router}"):
        connect(config, "test", timeout=0.1)


def test_a_malformed_endpoint_is_named(tmp_path: Path) -> None:
    rig = TestRig(tmp_path)
    text = rig.path.read_text().replace("tcp/127.0.0.1", "127.0.0.1")
    rig.path.write_text(text)
    with pytest.raises(BusError, match="expected an endpoint such as"):
        connect(load_rig(rig.path), "test", timeout=0.1)


def test_a_second_router_at_one_endpoint_is_refused(zenoh_rig: TestRig) -> None:
    with pytest.raises(BusError, match="no router can listen at"):
        open_router(zenoh_rig.config.bus.listen)


def test_a_killed_process_is_seen_to_be_gone(zenoh_rig: TestRig) -> None:
    watcher = zenoh_rig.bus("watcher")
    process = zenoh_rig.publisher(5)
    eventually(lambda: "alive/daq" in watcher.tokens("alive/*"), "daq is alive")
    process.send_signal(signal.SIGKILL)
    eventually(lambda: "alive/daq" not in watcher.tokens("alive/*"), "daq is gone")


def test_a_frozen_reader_never_stops_a_publisher(zenoh_rig: TestRig) -> None:
    """Under congestion control BLOCK this takes many seconds: the frozen reader's link fills."""
    frozen = zenoh_rig.start("-c", _FREEZING_READER, str(zenoh_rig.path))
    publisher, healthy = zenoh_rig.bus("publisher"), zenoh_rig.bus("healthy").subscribe(EVENTS)
    eventually(lambda: "alive/frozen" in publisher.tokens("alive/*"), "the reader is there")
    until_heard(publisher, healthy)
    done = threading.Event()

    def publish() -> None:
        for number in range(20_000):
            publisher.publish(EVENTS, event(f"{number} {'x' * 2000}"))
        done.set()

    with stopped(frozen):
        threading.Thread(target=publish, daemon=True).start()
        assert done.wait(PATIENCE)
        eventually(lambda: bool(healthy.drain()), "others still hear")


_FREEZING_READER = """
import sys, time
from rigwatch.wire.bus import connect
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.messages import EVENTS
from rigwatch.wire.messages.topics import EVENTS
bus = connect(load_rig(sys.argv[1]), "frozen")
subscription = bus.subscribe(EVENTS)
time.sleep(600)
"""


def test_a_message_says_from_which_process_it_came(join: Join) -> None:
    one, other, reader = join("one"), join("other"), join("reader")
    heard: list[tuple[bytes, str]] = []
    close = reader.transport.listen_from(
        reader.key(EVENTS.key), lambda payload, sender, _: heard.append((payload, sender))
    )
    for bus in (one, other):
        sent = encode(event(bus.process))

        def arrives(bus: Bus = bus, sent: bytes = sent) -> bool:
            bus.publish(EVENTS, event(bus.process))
            return (sent, bus.identity) in heard

        eventually(arrives, f"a message of {bus.process} under its identity")
    assert {sender for _, sender in heard} == {one.identity, other.identity}
    assert one.identity != other.identity
    close()

"""Tokens with names: few keys over any number of starts, and the name known to all."""

import pytest

from rigwatch.wire.bus import unique_process
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.bus.tokens import SLOTS
from rigwatch.wire.delivery import SampleReader, SampleRing
from rigwatch.wire.messages import ALARMS, GAPS, SAMPLES, encode
from rigwatch.wire.ordering import Numbered, RingReply
from tests.bus.samples import block
from tests.bus.test_complete_subscription import alarm, heard, say
from tests.waiting import PATIENCE, eventually

Seen = list[tuple[str, str | None, bool]]


def test_any_number_of_starts_and_boots_takes_few_keys():
    network, seen = MemoryNetwork(), set[str]()
    watcher = network.bus("r", "watcher")
    watcher.watch_tokens("source/*", lambda key, _: seen.add(key))
    watcher.watch_tokens("said/*/*", lambda key, _: seen.add(key))
    for start in range(SLOTS):
        bus = network.bus("r", "monitor")
        token = bus.named_token("source")
        for boot in range(5):
            token.declare(f"{boot}/{start}")
        say(bus, range(1))
        bus.close()
    assert 0 < len(seen) <= 2 * SLOTS


def test_commands_of_which_several_may_run_share_a_token():
    network = MemoryNetwork()
    network.bus("r", unique_process("doctor"))
    assert network.bus("r", "observer").tokens("alive/doctor*") == ["alive/doctor"]


def test_a_name_is_told_as_its_token_appears_and_vanishes():
    network, seen = MemoryNetwork(), Seen()
    holder = network.bus("r", "daq")
    network.bus("r", "reader").watch_names("source", lambda *change: seen.append(change))
    token = holder.named_token("source")
    token.declare("5/17")
    token.declare("6/18")
    first, second = f"5/17/{holder.identity}", f"6/18/{holder.identity}"
    assert seen == [
        ("source", None, True),
        ("source", first, True),
        ("source", first, False),
        ("source", None, True),
        ("source", second, True),
    ]


def test_who_comes_later_asks_for_the_name_until_it_is_answered():
    network, seen = MemoryNetwork(), Seen()
    holder, late = network.bus("r", "daq"), network.bus("r", "late")
    holder.named_token("source").declare("5/17")
    name = f"5/17/{holder.identity}"
    assert late.names("source") == [("source", name)]
    network.up = False
    late.watch_names("source", lambda *change: seen.append(change))
    assert late.names("source") == [("source", None)]
    network.up = True
    eventually(lambda: ("source", name, True) in seen, "the name")
    late.close()


def test_two_holders_of_a_place_have_keys_of_their_own():
    network = MemoryNetwork()
    holders = [network.bus("r", "daq") for _ in range(4)]
    for holder in holders:
        holder.named_token("source").declare("5/17")
    assert len(set(holders[0].tokens("source/*"))) == 4
    names = {name for _, name in holders[0].names("source")}
    assert names == {f"5/17/{holder.identity}" for holder in holders}


def test_nobody_names_the_token_of_another():
    network, seen = MemoryNetwork(), Seen()
    holder, stranger = network.bus("r", "daq"), network.bus("r", "stranger")
    network.bus("r", "reader").watch_names("source", lambda *change: seen.append(change))
    for slot in range(SLOTS):
        key = holder.key(f"source/{slot}")
        stranger.transport.put(key, f"{key} 5/0/{holder.identity}".encode())
    holder.named_token("source").declare("5/17")
    assert seen[-1] == ("source", f"5/17/{holder.identity}", True)


def test_messages_that_come_before_the_name_are_delivered_with_it():
    network = MemoryNetwork()
    monitor, slow = network.bus("r", "monitor"), network.bus("r", "monitor")
    listener = network.bus("r", "listener").listen(ALARMS)
    token = slow.transport.declare_token(slow.key(f"said/monitor/{SLOTS}"))
    key = monitor.key(ALARMS.key)
    slow.transport.put(key, encode(alarm(0)), Numbered(99, 0, b"").mark)
    assert listener.drain() == []
    name = f"{slow.key(f'said/monitor/{SLOTS}')} 99/5/{slow.identity}".encode()
    slow.serve(f"said/monitor/{SLOTS}", lambda _: [name])
    slow.transport.put(slow.key(f"said/monitor/{SLOTS}"), name)
    assert heard(listener, 0) == [0]
    token()


def test_messages_whose_sender_ends_before_its_name_is_known_are_a_gap():
    network = MemoryNetwork()
    gaps = network.bus("r", "observer").subscribe(GAPS)
    listener = network.bus("r", "listener").listen(ALARMS)
    killed = network.bus("r", "monitor")
    token = killed.transport.declare_token(killed.key("said/monitor/3"))
    for number in range(3):
        mark = Numbered(99, number, b"").mark
        killed.transport.put(killed.key(ALARMS.key), encode(alarm(number)), mark)
    assert listener.drain() == []
    token()
    assert listener.drain() == []
    (gap,) = listener.reports()
    assert gaps.get(PATIENCE) == gap
    assert (gap.topic, gap.device, gap.boot, gap.first, gap.last) == (
        "alarms",
        "monitor",
        99,
        0,
        -1,
    )


HUGE = [f"{10**30}/0", f"{2**63}/0", f"{-(2**63) - 1}/0"]
"""Numbers that no run or boot has, nor a question to a ring: 64 bits."""


@pytest.mark.parametrize("name", HUGE)
@pytest.mark.parametrize("process", ["monitor", "stranger"])
def test_a_name_with_a_number_beyond_64_bits_ends_no_listener(name: str, process: str):
    network = MemoryNetwork()
    monitor, stranger = network.bus("r", "monitor"), network.bus("r", "stranger")
    say(monitor, range(1))
    early = network.bus("r", "early").listen(ALARMS)
    stranger.named_token(f"said/{process}").declare(name)
    late = network.bus("r", "late").listen(ALARMS)
    network.up = False
    say(monitor, range(1, 5))
    network.up = True
    for listener in (early, late):
        assert heard(listener, until=4) == [1, 2, 3, 4]  # what was lost is still asked for
        listener.close()


@pytest.mark.parametrize("name", HUGE)
def test_a_source_with_a_number_beyond_64_bits_ends_no_reader(name: str):
    network = MemoryNetwork()
    daq, stranger = network.bus("r", "daq"), network.bus("r", "stranger")
    ring = SampleRing(daq, 4096)
    reader = SampleReader(network.bus("r", "reader"))
    stranger.named_token("source").declare(name)
    for part in (block(0, 4), block(4, 4), block(8, 4)):
        ring.add(part)
        if part.seq != 4:
            daq.publish(SAMPLES, part)
    eventually(lambda: reader.read(0.05) is not None and reader.position == (7, 11), "all samples")
    reader.close()


def test_a_ring_that_tells_a_number_beyond_all_messages_ends_no_listener():
    network = MemoryNetwork()
    monitor, stranger = network.bus("r", "monitor"), network.bus("r", "stranger")
    say(monitor, range(1))
    run = monitor._numbered().run
    reply = RingReply(run, 2**63 - 1, ()).to_bytes()
    end = stranger.serve("ring/monitor/alarms", lambda _: [reply])
    listener = network.bus("r", "listener").listen(ALARMS)
    end()
    say(monitor, range(1, 5))
    assert heard(listener, until=4) == [1, 2, 3, 4]
    listener.close()


def test_a_process_that_calls_the_run_of_another_its_own_silences_nobody():
    network = MemoryNetwork()
    monitor, stranger = network.bus("r", "monitor"), network.bus("r", "stranger")
    say(monitor, range(1))
    listener = network.bus("r", "listener").listen(ALARMS)
    token = stranger.named_token("said/stranger")
    token.declare(f"{monitor._numbered().run}/0")
    say(monitor, range(1, 3))
    assert [message.seq for message in listener.drain()] == [1, 2]
    token.close()
    say(monitor, range(3, 5))
    assert [message.seq for message in listener.drain()] == [3, 4]
    assert listener.foreign == 0
    listener.close()

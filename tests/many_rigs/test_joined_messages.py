"""Messages of several rigs sent as one, over a real router: who hears them, and whose they are."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from rigwatch.keys import Authority
from rigwatch.wire.bus import Bus, SharedLinks, connect, open_router
from rigwatch.wire.bus.several.joint_message import join, joint_key, split
from rigwatch.wire.delivery import SampleReader, SampleRing
from rigwatch.wire.messages import (
    ESTIMATES,
    EVENTS,
    HEALTH,
    SAMPLES,
    Column,
    EstimateBlock,
    Event,
    Health,
    SampleBlock,
    encode,
)
from rigwatch.wire.rig_config import RigConfig, load_rig
from tests.bus.rig import TestRig, kill
from tests.bus.samples import block
from tests.bus.test_security import config_with
from tests.monitor_process.test_several import rig_file
from tests.waiting import PATIENCE, eventually

RIGS = ("a", "b", "c")


@pytest.fixture
def base(tmp_path: Path) -> Iterator[TestRig]:
    with TestRig(tmp_path) as made:
        made.router()
        yield made


@pytest.fixture
def configs(base: TestRig, tmp_path: Path) -> list[RigConfig]:
    return [load_rig(rig_file(tmp_path, name, base.listen)) for name in RIGS]


@dataclass
class Several:
    """A process of several rigs."""

    links: SharedLinks = field(default_factory=lambda: SharedLinks(len(RIGS)))
    buses: list[Bus] = field(default_factory=list)

    def join(self, config: RigConfig, process: str) -> Bus:
        self.buses.append(connect(config, process, PATIENCE, self.links))
        return self.buses[-1]

    def close(self) -> None:
        for bus in self.buses:
            bus.close()
        self.links.close()


@pytest.fixture
def several() -> Iterator[Callable[[], Several]]:
    made: list[Several] = []

    def one() -> Several:
        made.append(Several())
        return made[-1]

    yield one
    for process in made:
        process.close()


class Source:
    """The samples of some rigs, sent by one process a turn at a time."""

    def __init__(self, buses: list[Bus], links: SharedLinks) -> None:
        self.buses, self._links = buses, links
        self._rings = [SampleRing(bus, 4096) for bus in buses]
        self.sent = 0

    def turn(self, count: int = 9) -> None:
        with self._links.together():
            for bus, ring in zip(self.buses, self._rings, strict=True):
                ring.add(block(self.sent, count))
                bus.publish(SAMPLES, block(self.sent, count))
        self.sent += count


def numbers(items: list[object]) -> list[int]:
    blocks = [item for item in items if isinstance(item, SampleBlock)]
    return [seq for one in blocks for seq in range(one.seq, one.seq + len(one))]


def read_until(reader: SampleReader, found: list[object], last: int) -> None:
    def there() -> bool:
        found.extend(reader.read(0.02))
        return last in numbers(found)

    eventually(there, f"sample {last}")


def hear_first(source: Source, readers: list[SampleReader]) -> list[list[object]]:
    """What each reader hears until all hear the source: a router may be slow to learn of them."""
    found: list[list[object]] = [[] for _ in readers]

    def all_hear() -> bool:
        source.turn()
        for reader, items in zip(readers, found, strict=True):
            items.extend(reader.read(0.02))
        return all(map(numbers, found))

    eventually(all_hear, "the first samples")
    return found


def test_rigs_of_one_process_are_heard_whole_by_processes_of_many_and_of_one(
    base: TestRig, configs: list[RigConfig], several: Callable[[], Several]
) -> None:
    sending, hearing = several(), several()
    source = Source([sending.join(config, "daq") for config in configs], sending.links)
    readers = [SampleReader(hearing.join(config, "monitor")) for config in configs]
    readers.append(SampleReader(base.bus("alone", configs[1])))
    found = hear_first(source, readers)
    for _ in range(40):
        source.turn()
    for reader, items in zip(readers, found, strict=True):
        read_until(reader, items, source.sent - 1)
        assert numbers(items) == list(range(numbers(items)[0], source.sent))
        counted = reader.counters
        assert counted.lost == counted.duplicates == counted.foreign == reader.rejected == 0


def test_a_turn_of_several_rigs_is_one_message(
    base: TestRig, configs: list[RigConfig], several: Callable[[], Several]
) -> None:
    sending, joint = several(), list[bytes]()
    source = Source([sending.join(config, "daq") for config in configs], sending.links)
    base.bus("ear").transport.listen_from(
        joint_key(SAMPLES.key), lambda payload, *_: joint.append(payload)
    )

    def a_turn_was_one_message() -> bool:
        source.turn()
        return any([rig for rig, _, _ in split(one)] == [*RIGS] for one in tuple(joint))

    eventually(a_turn_was_one_message, "a message of all three rigs")


def test_a_rig_of_its_own_process_is_heard_by_a_process_of_many(
    base: TestRig, configs: list[RigConfig], several: Callable[[], Several]
) -> None:
    hearing = several()
    bus = base.bus("daq", configs[0])
    ring, reader = SampleRing(bus, 4096), SampleReader(hearing.join(configs[0], "monitor"))
    found: list[object] = []
    sent = 0

    def heard() -> bool:
        nonlocal sent
        for seq in range(sent, sent := sent + 200):
            ring.add(block(seq))
            bus.publish(SAMPLES, block(seq))
        found.extend(reader.read(0.02))
        return bool(numbers(found))

    eventually(heard, "the first samples")
    read_until(reader, found, sent - 1)
    assert numbers(found) == list(range(numbers(found)[0], sent))
    assert reader.counters.duplicates == reader.counters.lost == 0


def test_estimates_of_several_rigs_are_heard_each_once_and_in_order(
    base: TestRig, configs: list[RigConfig], several: Callable[[], Several]
) -> None:
    sending, hearing = several(), several()
    monitors = [sending.join(config, "monitor") for config in configs]
    for monitor in monitors:
        monitor.announce()
    listeners = [hearing.join(config, "recorder").listen(ESTIMATES) for config in configs]
    listeners.append(base.bus("alone", configs[2]).listen(ESTIMATES))
    for seq in range(300):
        with sending.links.together():
            for monitor in monitors:
                monitor.publish(ESTIMATES, estimate(seq))
    for listener in listeners:
        heard: list[int] = []

        def there(heard: list[int] = heard, listener=listener) -> bool:  # type: ignore[no-untyped-def]
            heard += [one.seq for one in listener.drain()]
            return 299 in heard

        eventually(there, "the last estimate")
        assert heard == [*range(300)]
        assert listener.lost == listener.foreign == listener.rejected == 0


def test_health_of_several_rigs_is_one_message_for_processes_of_many_and_each_ones_own(
    base: TestRig, configs: list[RigConfig], several: Callable[[], Several]
) -> None:
    sending, hearing, joint = several(), several(), list[bytes]()
    daqs = [sending.join(config, "daq") for config in configs]
    listeners = [hearing.join(config, "monitor").subscribe_own(HEALTH, "daq") for config in configs]
    alone = base.bus("alone", configs[1]).subscribe(HEALTH)
    base.bus("ear").transport.listen_from(
        joint_key(HEALTH.key_of("daq")), lambda payload, *_: joint.append(payload)
    )
    listeners.append(alone)
    heard: list[list[int]] = [[] for _ in listeners]
    sent = 0

    def all_hear() -> bool:
        nonlocal sent
        with sending.links.together():
            for daq in daqs:
                daq.publish(HEALTH, Health("daq", sent, "running", "", {"samples": 1.0}))
        sent += 1
        for listener, times in zip(listeners, heard, strict=True):
            one = listener.get(timeout=0.2)
            if one is not None:
                times.append(one.t_ns)
        return all(len(times) > 3 for times in heard)

    eventually(all_hear, "the health of each rig")
    for times in heard:
        assert times == [*range(times[0], times[0] + len(times))]
    assert any([rig for rig, _, _ in split(one)] == [*RIGS] for one in tuple(joint))


def test_health_of_a_rig_of_its_own_process_is_heard_by_a_process_of_many(
    base: TestRig, configs: list[RigConfig], several: Callable[[], Several]
) -> None:
    bus = base.bus("daq", configs[0])
    listener = several().join(configs[0], "monitor").subscribe_own(HEALTH, "daq")

    def heard() -> bool:
        bus.publish(HEALTH, Health("daq", 1, "running", "", {}))
        return len(listener) > 0

    eventually(heard, "its health")
    assert {one.source for one in listener.drain()} == {"daq"}
    assert listener.rejected == 0


def estimate(seq: int) -> EstimateBlock:
    column = Column("residual", "m/s^2", np.array([float(seq)]))
    return EstimateBlock("rig", 7, seq, np.array([seq], np.int64), (column,))


def test_nobody_speaks_for_a_rig_in_a_joined_message_but_its_owner(
    base: TestRig, configs: list[RigConfig], several: Callable[[], Several]
) -> None:
    sending, hearing = several(), several()
    source = Source([sending.join(config, "daq") for config in configs], sending.links)
    bus = hearing.join(configs[0], "monitor")
    reader, stranger = SampleReader(bus), base.bus("stranger", configs[0])
    events = stranger.subscribe(EVENTS)
    (found,) = hear_first(source, [reader])
    next_one = encode(block(source.sent, 3))
    forged = join([("a", b"", next_one), ("unknown", b"", b"?"), ("a", b"", b"rubbish")])
    for payload in (forged, b"rubbish"):
        stranger.transport.put(joint_key(SAMPLES.key), payload)
    eventually(lambda: found.extend(reader.read(0.02)) or reader.rejected == 2, "rejected")
    assert reader.counters.foreign == 3
    assert [*reader.rejected_by] == [stranger.identity]
    source.turn()
    read_until(reader, found, source.sent - 1)
    assert numbers(found) == list(range(numbers(found)[0], source.sent))
    told = [item.code for item in found if isinstance(item, Event)]
    assert told.count("DUPLICATE SOURCE") == 1
    codes: list[str] = []
    eventually(
        lambda: codes.extend(one.code for one in events.drain()) or "DUPLICATE SOURCE" in codes,
        "its event",
    )


def test_what_a_joined_message_lost_is_fetched_for_every_rig(
    base: TestRig, configs: list[RigConfig], several: Callable[[], Several]
) -> None:
    kill(base._processes[0])
    sending, hearing = several(), several()
    router = base.router()
    source = Source([sending.join(config, "daq") for config in configs], sending.links)
    readers = [SampleReader(hearing.join(config, "monitor")) for config in configs]
    found = hear_first(source, readers)
    kill(router)
    for _ in range(5):
        source.turn()
    base.router()
    eventually(lambda: all(bus.connected() for bus in (*sending.buses, *hearing.buses)), "a link")
    source.turn()
    for reader, items in zip(readers, found, strict=True):
        read_until(reader, items, source.sent - 1)
        assert numbers(items) == list(range(numbers(items)[0], source.sent))
        assert reader.counters.lost == 0
        assert reader.counters.recovered > 0


def test_with_keys_nothing_is_joined_and_everything_heard(tmp_path: Path) -> None:
    folder = tmp_path / "keys"
    authority = Authority.create(folder, "bench")
    for role in ("router", "daq", "monitor"):
        authority.issue(role, role)
    config = config_with(tmp_path, folder)
    close = open_router(config)
    sending, hearing = Several(), Several()
    source = Source([sending.join(config, "daq")], sending.links)
    reader = SampleReader(hearing.join(config, "monitor"))
    (found,) = hear_first(source, [reader])
    for _ in range(10):
        source.turn()
    read_until(reader, found, source.sent - 1)
    assert numbers(found) == list(range(numbers(found)[0], source.sent))
    assert reader.counters.lost == reader.rejected == 0
    for process in (sending, hearing):
        process.close()
    close()

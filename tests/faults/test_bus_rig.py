"""Faults of the bus on one running rig: a router, a publisher and a monitor behind a proxy."""

import time
from collections.abc import Iterator

import pytest

from monitor.process.startup_grace import SETTLING
from rigwatch.wire.bus import MAX_PAYLOAD, Bus
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import EVENTS, SAMPLES, Alarm, Event
from tests.bus.publisher import wave
from tests.bus.rig import kill, stopped
from tests.faults.field import Field, least_of, numbers
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("faults-modbus")
BOOT = 5
LEASE = 1.0
TWICE = 256
"""The source sends every so many samples one again."""
SILENCE = "[daq]\nstale_after = 0.09\n"
"""The alarm is bound to come within 100 ms: the silence it needs is shorter [s]."""


class BusRig(Field):
    """The rig, and a client that nobody has invited."""

    def begin(self) -> None:
        self.start()
        self.proxy, port = self.rig.proxy()
        text = self.rig.path.read_text()
        self.far = self.folder / "far.toml"
        self.far.write_text(text.replace(f'router = "tcp/127.0.0.1:{self.rig.listen}"',
                                         f'router = "tcp/127.0.0.1:{port}"'))  # fmt: skip
        self.start("monitor", path=self.far)
        self.rig.publisher(BOOT, "--wave", "--twice", f"{TWICE}")
        self.stranger: Bus = self.rig.bus("stranger")
        self.goes_on(1500)

    def newest(self) -> int:
        """Number of the newest sample with an estimate."""
        last = self.estimates()[-1] if self.estimates() else None
        return last.seq + len(last) - 1 if last else 0

    def goes_on(self, samples: int = 64) -> None:
        """So many further samples have estimates."""
        self.judged(BOOT, self.newest() + samples)

    def each_is_judged_once(self, first: int) -> None:
        judged = [n for n in numbers(self.estimates(), BOOT) if n >= first]
        missing = sorted(set(range(first, judged[-1] + 1)) - set(judged))
        assert not missing, (missing, self.gaps)
        assert judged == list(range(first, judged[-1] + 1))
        assert {b.boot for b in self.estimates()} == {BOOT}

    def renew(self) -> None:
        """A monitor behind the proxy, without a past: on a busy machine `stale` chatters."""
        self.forget_alarms(self.far)
        settled_ns = time.time_ns() + round(1.1e9 * SETTLING)
        eventually(
            lambda: any(b.t_ns[-1] > settled_ns for b in self.estimates()[-1:]), "it has settled"
        )

    def counted(self, name: str) -> float:
        """A counter of the monitor, from a health message that is sent after now."""
        return self.health_after("monitor", time.time_ns()).counters.get(name, 0.0)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BusRig]:
    folder = tmp_path_factory.mktemp("bus")
    section = 'adapter = "serial"\nport = "/dev/null"'
    with BusRig(folder, section, lease=LEASE, extra=SILENCE) as made:
        made.begin()
        yield made


def test_29_a_second_source(rig: BusRig) -> None:
    first, began = rig.newest(), time.time_ns()
    ring = SampleRing(rig.stranger, 256)
    one = wave(0, 1, BOOT + 1, began)
    ring.add(one)
    rig.stranger.publish(SAMPLES, one)
    alarm = rig.raised("duplicate_source", after_ns=began)
    assert alarm.severity == "critical", "after a single sample"
    rig.goes_on()
    rig.each_is_judged_once(first)
    ring.close()  # without keys, a monitor that starts would take its answers for the source's


def test_30_payloads_that_are_no_messages(rig: BusRig) -> None:
    who = f"rejected_of_{rig.stranger.identity}"
    before, of_stranger = rig.counted("rejected"), rig.counted(who)
    key = rig.stranger.key(SAMPLES.key)
    for payload in (b"", b"\xff" * 50, b"\x00", bytes(range(256))):
        rig.stranger.transport.put(key, payload)
    first = rig.newest()
    rig.goes_on()
    told = rig.health_after("monitor", time.time_ns()).counters
    assert told["rejected"] - before == told[who] - of_stranger >= 3, "each by its sender"
    rig.each_is_judged_once(first)


def test_31_a_payload_too_large(rig: BusRig) -> None:
    before, first = rig.counted("rejected"), rig.newest()
    for topic in (SAMPLES, EVENTS):
        rig.stranger.transport.put(rig.stranger.key(topic.key), b"x" * (MAX_PAYLOAD + 1))
    with pytest.raises(BusError, match="expected at most"):
        rig.stranger.publish(EVENTS, Event("test", 1, "info", "TEST", "x" * MAX_PAYLOAD))
    rig.goes_on()
    assert rig.counted("rejected") == before, "the router forwards it to nobody"
    rig.each_is_judged_once(first)


def test_32_samples_that_are_played_again(rig: BusRig) -> None:
    before, first = rig.counted("foreign_samples"), rig.newest()
    old = wave(max(0, first - 512), 16, BOOT, time.time_ns() - 2 * 10**9)
    rig.stranger.publish(SAMPLES, old)
    rig.stranger.publish(SAMPLES, wave(0, 16, BOOT + 2, time.time_ns() - 60 * 10**9))
    rig.goes_on()
    assert rig.counted("foreign_samples") - before >= 32, "of another owner, or too old"
    rig.each_is_judged_once(first)
    again = rig.counted("duplicate_samples")
    rig.goes_on(2 * TWICE)
    assert rig.counted("duplicate_samples") >= again + 2, "numbers already delivered"
    rig.each_is_judged_once(first)


def test_26_a_router_that_restarts(rig: BusRig) -> None:
    first, told = rig.newest(), list[Alarm]()

    def heard(alarm: Alarm) -> int:
        """How often the observer has heard it."""
        return sum((a.name, a.state, a.t_ns) == (alarm.name, alarm.state, alarm.t_ns)
                   for a in rig.alarms)  # fmt: skip

    def restart() -> float:
        """From the router's return until estimates and alarms of its absence are here [s]."""
        rig.cleared("link")
        began = time.time_ns()
        rig.kill("router")
        eventually(lambda: not rig.bus.connected(), "the router is missed")
        told.append(rig.raised("link", after_ns=began))
        rig.processes["router"] = rig.rig.router()
        back, last = time.monotonic(), rig.newest()
        rig.judged(BOOT, last + 1)
        eventually(lambda: heard(told[-1]) > 0, "the alarm is fetched")
        return time.monotonic() - back

    least_of(restart, 1.0, rig.goes_on)
    rig.goes_on()
    rig.each_is_judged_once(first)
    assert list(map(heard, told)) == [1] * len(told), "once"


@pytest.mark.parametrize(
    "seconds",
    [
        pytest.param(0.5, id="short"),
        pytest.param(2.5, id="longer than the lease", marks=pytest.mark.nightly),
    ],
)
def test_27_a_partition(rig: BusRig, seconds: float) -> None:
    """All that a row says is asserted at each attempt.

    The alarm is not waited for to clear: where a busy machine delays samples again and again it
    chatters, and stands until a minute has passed without one.
    """

    def partition() -> float:
        first, since, began = rig.newest(), len(rig.gaps), time.time_ns()
        with stopped(rig.proxy):
            took = rig.noticed("stale", began)
            time.sleep(seconds)
        rig.goes_on(300)
        rig.each_is_judged_once(first)
        assert [g for g in rig.gaps[since:] if (g.reporter, g.boot) == ("monitor", BOOT)] == []
        return took

    if rig.restless("stale"):
        rig.renew()
    least_of(partition, 0.1, rig.renew)


def test_28_a_late_joiner(rig: BusRig) -> None:
    kill(rig.processes.pop("monitor"))
    rig.journal.with_name("alarms.jsonl.position").unlink()
    began = time.time_ns()
    rig.start("monitor")
    event = rig.event("JOINED", began)
    boot, seq = event.text.removeprefix("joined boot ").split(" at seq ")
    assert int(boot) == BOOT
    rig.judged(BOOT, int(seq))
    judged = [b for b in rig.estimates() if b.t_ns[-1] > began]
    assert min(b.seq for b in judged if b.seq >= int(seq)) == int(seq)

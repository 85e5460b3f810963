"""Faults of a Modbus device on one running rig: a real server, a proxy before it, daq, monitor."""

import math
import signal
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from rigwatch.wire.bus import connect
from rigwatch.wire.device import HEADER_LENGTH
from rigwatch.wire.host import free_port
from rigwatch.wire.messages import EVENTS, HEALTH, SAMPLES
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.rig_config import load_rig
from sim_plant.serve import Device, ModbusServer, RegisterBank
from tests.bus.rig import answers, kill
from tests.daq.test_modbus_faults import late, short
from tests.faults.field import AMPLITUDE, GAINS, RATE, Field, WaveSource, least_of
from tests.waiting import eventually

pytestmark = [pytest.mark.xdist_group("faults-modbus"), pytest.mark.long]
TIMEOUT, POLLS = 0.1, 32.0
FUNCTION = 7
"""Place in a reply of its function code, whose highest bit refuses."""
MEANINGS = [
    (2, "illegal address"),
    (4, "device failure"),
    (5, "acknowledged, not ready yet"),
    (6, "busy"),
]
FIRST_SLOT = 9 + 2 * (4 + 1)
"""Place in a reply of slots of the high byte of the first sample's position."""
Edit = Callable[["Replies", bytes], bytes]


class Replies:
    """Disturbs the next `left` replies of a server with `edit`, and remembers when it began."""

    def __init__(self) -> None:
        self.left, self.held, self.t_ns = 0, b"", 0
        self.refused_ns: list[int] = []
        self.edit: Edit = lambda replies, data: data

    def disturb(self, edit: Edit, replies: int) -> None:
        self.edit, self.t_ns, self.left = edit, 0, replies

    def trace(self, sending: bool, data: bytes) -> bytes:
        if sending and data[FUNCTION] & 0x80:
            self.refused_ns.append(time.time_ns())
        if not sending or (self.left == 0 and not self.held):
            return data
        self.t_ns = self.t_ns or time.time_ns()
        self.left = max(self.left - 1, 0)
        return self.edit(self, data)


def nothing(replies: Replies, data: bytes) -> bytes:
    return b""


def of_another_question(replies: Replies, data: bytes) -> bytes:
    return bytes([data[0] ^ 0x40]) + data[1:]


def twice(replies: Replies, data: bytes) -> bytes:
    return data + data


def flipped(replies: Replies, data: bytes) -> bytes:
    """One high bit of a position; the header is left alone."""
    if data[8] == 2 * HEADER_LENGTH:
        replies.left += 1
        return data
    return data[:FIRST_SLOT] + bytes([data[FIRST_SLOT] ^ 0x40]) + data[FIRST_SLOT + 1 :]


class ModbusRig(Field):
    """The rig; its device's clock runs fast by 0.6 % from the start."""

    def begin(self, port: int) -> None:
        source = WaveSource()
        self.device = Device(source)
        self.device.drift_ppm = 6000.0
        source.device = self.device
        self.replies = Replies()
        self.server = ModbusServer(self.device, RegisterBank(3), trace=self.replies.trace)
        self.beside(lambda stop: self.server.run_tcp("127.0.0.1", port, stop))
        eventually(lambda: answers(port), "the server listens")
        self.server_port = port
        self.open_proxy()
        self.start("daq", "monitor")
        self.settle(self.device)

    def open_proxy(self) -> None:
        ports = str(self.port), str(self.server_port)
        self.proxy = self.rig.start("-m", "tests.bus.rig", *ports)
        eventually(lambda: answers(self.port), "the proxy listens")

    def every_sample_is_right(self, first: int) -> None:
        """From `first` on each came once, or was reported, with the value of its number."""
        self.judged(self.device.boot, self.device.next_seq)
        found = {
            b.seq + i: v
            for b in list(self.samples)
            for i, v in enumerate(b.channel("position").values)
        }
        told = {n for g in self.gaps if g.reporter == "daq/rig" for n in range(g.first, g.last + 1)}
        numbers = np.array(sorted(n for n in found if n >= first))
        missing = set(range(first, int(numbers[-1]))) - set(numbers.tolist())
        assert missing <= told
        wave = np.rint(AMPLITUDE * np.sin(2 * np.pi * 8.0 * numbers / RATE)) * GAINS["position"]
        np.testing.assert_allclose([found[n] for n in numbers], wave, atol=1e-12)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModbusRig]:
    port = free_port()
    section = f'adapter = "modbus-tcp"\nhost = "127.0.0.1"\nport = {port}\ntimeout = {TIMEOUT}'
    keys = {"position": "spike_above = 0.004"}
    with ModbusRig(tmp_path_factory.mktemp("modbus"), section, keys=keys) as made:
        made.port = port  # type: ignore[attr-defined]
        made.begin(free_port())
        yield made


def noticed(rig: ModbusRig, edit: Edit, replies: int, text: str) -> None:
    """Replies are disturbed: an event after one poll and its timeout; no sample wrong or lost."""

    def disturb() -> float:
        time.sleep(1.1)  # an event a second
        since = len(rig.gaps)
        rig.replies.disturb(edit, replies)
        eventually(lambda: rig.replies.t_ns > 0, "a reply is disturbed")
        event = rig.event("poll_failed", rig.replies.t_ns)
        rig.judged(rig.device.boot, rig.device.next_seq)
        lost = any(g.reporter == "daq/rig" for g in rig.gaps[since:])
        if lost or text not in event.text:  # a busy machine was late on its own
            return math.inf
        return (event.t_ns - rig.replies.t_ns) * 1e-9

    first, before = rig.device.next_seq, rig.health("daq").counters["failed_polls"]
    least_of(disturb, TIMEOUT + 1.0 / POLLS, lambda: None)
    told = rig.health_after("daq", time.time_ns())
    assert told.counters["failed_polls"] > before
    rig.every_sample_is_right(first)


def test_19_a_reply_that_does_not_come(rig: ModbusRig) -> None:
    noticed(rig, nothing, 1, "no valid answer in time")


def test_22_a_short_reply(rig: ModbusRig) -> None:
    noticed(rig, short, 1, "a reply of")


def test_25_late_foreign_and_doubled_replies(rig: ModbusRig) -> None:
    noticed(rig, of_another_question, 1, "no valid answer in time")
    noticed(rig, late, 1, "no valid answer in time")
    first, failed = rig.device.next_seq, rig.health("daq").counters["failed_polls"]
    rig.replies.disturb(twice, 3)
    eventually(lambda: rig.replies.left == 0, "replies come twice")
    rig.judged(rig.device.boot, rig.device.next_seq + 64)
    assert rig.health("daq").counters["failed_polls"] <= failed + 1
    rig.every_sample_is_right(first)


def refused(rig: ModbusRig, code: int, words: str, times: int) -> float:
    """The server refuses with a code: the alarm names it, so long after the last that it takes [s].

    Infinite if it came before: a poll of a busy machine also failed for another reason.
    """
    rig.calm(rig.device, "link")
    rig.replies.refused_ns, began = [], time.time_ns()
    rig.server.exception = code
    alarm = rig.raised("link", after_ns=began)
    last = rig.replies.refused_ns[times - 1 : times] or [alarm.t_ns]
    told = (alarm.t_ns - last[0]) * 1e-9
    rig.server.exception = 0
    assert f"exception code {code}, {words}" in alarm.cause
    assert ("3 polls in a row failed" in alarm.cause) == (times == 3)
    rig.cleared("link")
    return told if told > 0 else math.inf


@pytest.mark.parametrize(("code", "words"), MEANINGS)
def test_20_exception_codes(rig: ModbusRig, code: int, words: str) -> None:
    first, times = rig.device.next_seq, 3 if code in {5, 6} else 1
    least_of(lambda: refused(rig, code, words, times), 1.0 / POLLS, lambda: None)
    rig.every_sample_is_right(first)


def test_21_another_word_order(rig: ModbusRig) -> None:
    text = rig.rig.path.read_text().replace('id = "bench"', 'id = "other"')
    path = rig.folder / "other.toml"
    path.write_text(text.replace("timeout = 0.1", 'timeout = 0.1\nword_order = "little"'))
    bus = connect(load_rig(path), "observer")
    events, health, samples = (bus.subscribe(topic) for topic in (EVENTS, HEALTH, SAMPLES))
    daq = rig.rig.start("-m", "rigwatch", "daq", str(path))
    told: list[str] = []

    def said() -> bool:
        told.extend(one.text for one in [*events.drain(), *health.drain()])
        return any("set word_order = 'big'" in text for text in told)

    eventually(said, "the right word order is named")
    assert samples.drain() == []
    kill(daq)
    bus.close()


def test_23_a_bit_that_flips(rig: ModbusRig) -> None:
    def counted() -> float:
        told = rig.health_after("daq", time.time_ns()).counters
        return sum(told.get(f"flagged_{name}", 0.0) for name in ("spike", "saturated"))

    boot, before, first = rig.device.boot, counted(), rig.device.next_seq
    rig.replies.disturb(flipped, 1)
    eventually(lambda: rig.replies.left == 0 and rig.replies.t_ns > 0, "a bit flips")
    last = rig.device.next_seq + 256
    rig.judged(boot, last)
    values, flags = rig.read("position", boot, first - 256, last)
    (bad,) = np.flatnonzero(flags)
    assert flags[bad] in (quality.SPIKE, quality.SATURATED), "that sample"
    right = np.rint(AMPLITUDE * np.sin(2 * np.pi * 8.0 * (first - 256 + bad) / RATE))
    assert abs(values[bad] / GAINS["position"] - right) > 1000, "the one whose bit has flipped"
    assert counted() == before + 1
    for name in ("theta1", "theta2"):
        theta = np.concatenate([b.column(name).values for b in rig.estimates()
                                if b.boot == boot and first - 256 <= b.seq <= last])  # fmt: skip
        before_it = np.abs(theta[:128]).max()
        assert np.abs(theta[128:]).max() < 3.0 * before_it + 0.01, "kept out of the estimates"
    assert not [one for one in rig.journalled("departure") if one.alarm.seq >= first]


THREE_POLLS = 3 * (TIMEOUT + 1.0 / POLLS)
BACK_WITHIN = 1.5


def the_gap_is_exact(rig: ModbusRig, first: int, since: int) -> int:
    """What was reported lost is what did not come, from `first` or the loss on; its number."""
    rig.judged(rig.device.boot, rig.device.next_seq)
    here = {b.seq + i for b in list(rig.samples) for i in range(len(b))}
    last = max(here)
    told = [n for g in rig.gaps[since:] if g.reporter == "daq/rig"
            for n in range(g.first, g.last + 1)]  # fmt: skip
    missing = [n for n in range(min([first, *told]), last) if n not in here]
    assert sorted(told) == missing
    return len(missing)


def away(rig: ModbusRig, gone: Callable[[], None], back: Callable[[], None], for_s: float) -> float:
    """The longer of the times to the alarm and to the return, each as a share of its bound."""
    rig.calm(rig.device, "link")
    began = time.time_ns()
    gone()
    alarm = rig.raised("link", after_ns=began)
    assert alarm.cause
    time.sleep(for_s)
    back()
    returned = time.time_ns()
    event = rig.event("running", alarm.t_ns)
    rig.cleared("link")
    told_s, back_s = (alarm.t_ns - began) * 1e-9, (event.t_ns - returned) * 1e-9
    return max(told_s / THREE_POLLS, back_s / BACK_WITHIN)


@pytest.mark.parametrize(
    "frozen_s",
    [
        pytest.param(0.5, id="within the ring"),
        pytest.param(3.5, id="longer than the ring", marks=pytest.mark.nightly),
    ],
)
def test_24_a_server_that_hangs(rig: ModbusRig, frozen_s: float) -> None:
    def hang() -> float:
        first, since = rig.device.next_seq, len(rig.gaps)
        try:
            took = away(
                rig,
                lambda: rig.proxy.send_signal(signal.SIGSTOP),
                lambda: rig.proxy.send_signal(signal.SIGCONT),
                frozen_s,
            )
        finally:
            rig.proxy.send_signal(signal.SIGCONT)
        rig.every_sample_is_right(first)
        lost = the_gap_is_exact(rig, first, since)
        assert bool(lost) == (frozen_s > 2.0), "what the device still has is fetched"
        return took

    least_of(hang, 1.0, lambda: None)


def test_24_a_server_that_starts_again(rig: ModbusRig) -> None:
    def restart() -> float:
        first, since = rig.device.next_seq, len(rig.gaps)
        took = away(rig, lambda: kill(rig.proxy), rig.open_proxy, 0.5)
        rig.every_sample_is_right(first)
        the_gap_is_exact(rig, first, since)
        return took

    least_of(restart, 1.0, lambda: None)


def test_09_a_clock_that_runs_fast(rig: ModbusRig) -> None:
    for name in ("clock_drift", "clock_wrong"):
        alarm = rig.raised(name)
        # The estimate begins anew where the line was away, as in other tests of this rig.
        back = [e.t_ns for e in rig.events if e.code == "running" and e.t_ns < alarm.t_ns]
        began = max([rig.samples[0].t_ns[0], *back])
        assert (alarm.t_ns - began) * 1e-9 <= 60.0
    assert rig.health("daq").counters["drift_ppm"] == pytest.approx(6000.0, rel=0.1)

"""Raw blocks to messages: long blocks, the host's clock, and what is said about the device's."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from daq.acquisition import LONGEST_BLOCK, Acquisition
from daq.adapter import RawBlock
from daq.watch import Link
from rigwatch.wire.bus import MAX_PAYLOAD
from rigwatch.wire.messages import continues, merged
from rigwatch.wire.messages.message_types import Event, Health, SampleBlock
from rigwatch.wire.messages.protobuf import decode, encode
from tests.daq.rig import codes_of, config_of

SECOND = 1_000_000_000
UP = Link(connected=True)


def raw_of(first: int, count: int, drift: float = 0.0) -> RawBlock:
    seq = np.arange(first, first + count)
    host = np.rint(seq * 1e9 / 256).astype(np.int64)
    us = np.rint(host * (1 + drift) / 1000).astype(np.int64)
    return RawBlock(7, seq, us, codes_of(seq), host)


def acquisition(host_offset_ns: int = SECOND) -> tuple[Acquisition, list[int]]:
    offset = [host_offset_ns]
    config = config_of('adapter = "serial"\nport = "x"')
    return Acquisition(config, host_offset_ns=lambda: offset[0]), offset


def test_long_blocks_are_cut_to_what_a_message_carries() -> None:
    acquiring, _ = acquisition()
    blocks = acquiring.update(raw_of(0, 3 * LONGEST_BLOCK + 5))
    assert [len(block) for block in blocks] == [LONGEST_BLOCK] * 3 + [5]  # type: ignore[arg-type]
    assert acquiring.samples == 3 * LONGEST_BLOCK + 5


def test_blocks_of_many_channels_are_cut_to_what_the_bus_carries() -> None:
    config = config_of('adapter = "serial"\nport = "x"')
    many = tuple(msgspec.structs.replace(config.channels[0], name=f"c{k}") for k in range(48))
    acquiring = Acquisition(msgspec.structs.replace(config, channels=many))
    raw = raw_of(0, LONGEST_BLOCK + 5)
    wide = replace(raw, codes=np.tile(raw.codes, 16))
    blocks = [block for block in acquiring.update(wide) if isinstance(block, SampleBlock)]
    assert max(len(encode(block)) for block in blocks) <= MAX_PAYLOAD
    assert [n for b in blocks for n in range(b.seq, b.seq + len(b))] == list(range(1029))
    assert acquiring.samples == 1029


def test_messages_survive_the_wire() -> None:
    acquiring, _ = acquisition()
    (block,) = acquiring.update(raw_of(0, 8))
    assert isinstance(block, SampleBlock)
    again = decode(SampleBlock, encode(block))
    np.testing.assert_array_equal(again.channels[1].values, block.channels[1].values)
    assert (again.boot, again.seq, again.device) == (7, 0, "rig")


def test_a_step_of_the_host_clock_is_reported_and_time_goes_on() -> None:
    acquiring, offset = acquisition(host_offset_ns=100 * SECOND)
    (before,) = acquiring.update(raw_of(0, 1))
    offset[0] = 70 * SECOND
    said = acquiring.tick(SECOND // 50, UP, {})
    assert [m.code for m in said if isinstance(m, Event)] == ["clock_step"]
    (after,) = acquiring.update(raw_of(1, 1))
    assert isinstance(before, SampleBlock)
    assert isinstance(after, SampleBlock)
    assert after.t_ns[0] - before.t_ns[0] == pytest.approx(SECOND / 256, abs=1e4)


def test_stamps_that_were_far_ahead_come_back_are_told_and_lie_in_blocks_of_their_own() -> None:
    acquiring, offset = acquisition()
    (first,) = acquiring.update(raw_of(0, 1))
    offset[0] = 3600 * SECOND
    acquiring.tick(1, UP, {})
    (ahead,) = acquiring.update(raw_of(1, 1))
    offset[0] = SECOND
    said = acquiring.tick(SECOND, UP, {})
    (text,) = [one.text for one in said if isinstance(one, Event) and one.code == "clock_step"]
    assert "set back with it" in text
    assert [one.counters["stamps_ahead_s"] for one in said if isinstance(one, Health)] == [0.0]
    (after,) = acquiring.update(raw_of(2, 1))
    assert isinstance(first, SampleBlock)
    assert isinstance(ahead, SampleBlock)
    assert isinstance(after, SampleBlock)
    assert after.t_ns[0] - first.t_ns[0] == pytest.approx(2 * SECOND / 256, abs=1e4)
    assert continues(first, ahead)
    assert not continues(ahead, after)
    assert [len(one) for one in merged([first, ahead, after], 100)] == [2, 1]


def test_a_host_clock_that_is_set_forward_makes_no_slow_device() -> None:
    acquiring, offset = acquisition()
    for k in range(8):
        offset[0] += 4704 * SECOND * (k == 5)
        acquiring.tick(k * SECOND // 4, UP, {})
        acquiring.update(raw_of(64 * k, 64))
        acquiring.tick(k * SECOND // 4 + 1, UP, {})
        assert acquiring.watch.state == "running"


@pytest.mark.parametrize(("ppm", "severity"), [(1000.0, "warning"), (-6000.0, "error")])
def test_drift_is_reported_once_with_its_severity(ppm: float, severity: str) -> None:
    acquiring, _ = acquisition()
    events: list[Event] = []
    for second in range(30):
        acquiring.update(raw_of(second * 256, 256, drift=1e-6 * ppm))
        said = acquiring.tick((second + 1) * SECOND, UP, {})
        events += [m for m in said if isinstance(m, Event) and m.code == "clock_drift"]
    assert [event.severity for event in events] == [severity]
    assert f"{ppm:+.0f} ppm" in events[0].text


def test_a_drift_that_may_be_delays_is_not_reported() -> None:
    acquiring, _ = acquisition()
    figures: dict[str, float] = {}
    for second in range(30):
        raw = raw_of(second * 256, 256)
        acquiring.update(replace(raw, arrived_ns=raw.arrived_ns + 20_000_000 * (second > 11)))
        said = acquiring.tick((second + 1) * SECOND, UP, {})
        assert not [m for m in said if isinstance(m, Event) and m.code == "clock_drift"]
        figures = next((m.counters for m in said if isinstance(m, Health)), figures)
    assert abs(figures["certain_drift_ppm"]) < 100.0


def test_health_says_the_rate_now_on_average_and_at_worst() -> None:
    acquiring, _ = acquisition()
    said: list[object] = []
    for second, count in enumerate([256, 256, 200, 256]):
        acquiring.update(raw_of(second * 256, count))
        said += acquiring.tick((second + 1) * SECOND - 1_000_000 * (second == 0), UP, {"x": 1})
    health = [m for m in said if isinstance(m, Health)][-1]
    assert health.counters["rate_hz"] == pytest.approx(256, rel=0.01)
    assert health.counters["rate_worst_hz"] == pytest.approx(200, rel=0.01)
    assert 200 < health.counters["rate_mean_hz"] < 256
    assert (health.counters["lost_samples"], health.counters["x"]) == (56, 1)

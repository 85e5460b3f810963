"""Faults of the serial line and of the sensors, by their numbers in the fault catalogue.

Each line of the table injects one fault into a real pty, and says which events and figures must
follow. For all of them: every sample sent is delivered once, or told as lost.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from daq.adapter import DeviceBusyError
from daq.adapters.serial_line import SerialPort
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.messages.message_types import Gap
from tests.daq.rig import SerialBench, config_of

Inject = Callable[[SerialBench], object]
BURST = 5


@dataclass(frozen=True)
class Fault:
    """What is done to the line, and what must come of it.

    `lost`: (least, most) samples lost; `events`: codes that must be said; `figures`: of the health;
    `flags`: samples flagged in the channel "position" by flag; `boots`: boots seen.
    """

    number: int
    name: str
    inject: Inject
    lost: tuple[int, int] = (0, 0)
    events: tuple[str, ...] = ()
    figures: dict[str, tuple[float, float]] = field(default_factory=dict)
    flags: dict[int, int] = field(default_factory=dict)
    boots: int = 1
    first_seq: int = 0
    channel: str = ""
    before: int = 20


def line_fault(name: str, frames: int = BURST) -> Inject:
    def inject(bench: SerialBench) -> None:
        bench.faults.start(name, frames)
        bench.play(frames)

    return inject


def sensor(edit: Callable[[np.ndarray], None], samples: int) -> Inject:
    """Edit the codes of the channel "position" of the next samples."""

    def inject(bench: SerialBench) -> None:
        bench.source.edit = lambda seq, codes: edit(codes[:, 1])
        bench.play(samples)
        bench.source.edit = lambda seq, codes: None

    return inject


def stuck(codes: np.ndarray) -> None:
    codes[:] = 1234


def rail(codes: np.ndarray) -> None:
    codes[:] = 32767


def at_half_the_rate(bench: SerialBench, samples: int) -> None:
    bench.device.drift_ppm = 1e6
    bench.play(samples, period=2 / 256)
    bench.device.drift_ppm = 0.0


def replug(bench: SerialBench) -> None:
    bench.faults.start("unplug", BURST, bench.line.link.with_name("rig-other"))
    bench.play(BURST)


FAULTS = [
    Fault(1, "unplug", line_fault("unplug"), (1, 60), ("link_lost",), {"reconnects": (1, 1)}),
    Fault(2, "replug under another name", replug, (1, 60), ("link_lost",), {"reconnects": (1, 1)}),
    Fault(3, "silent device", lambda b: b.silence(0.3), events=("stale", "running")),
    Fault(4, "garbage", line_fault("garbage", 300), (300, 302), ("garbage", "stale")),
    Fault(5, "bit flips", line_fault("flip"), (BURST, BURST + 1), figures={"resyncs": (1, 1)}),
    Fault(6, "dropped bytes", line_fault("drop", 1), (1, 2), figures={"resyncs": (1, 1)}),
    Fault(6, "inserted bytes", line_fault("insert", 1), (0, 2)),
    Fault(6, "lost frames", line_fault("lose"), (BURST, BURST)),
    Fault(7, "duplicates", line_fault("duplicate"), figures={"duplicates": (BURST, BURST)}),
    Fault(8, "counter wraps", lambda b: b.play(60), first_seq=2**32 - 40),
    Fault(8, "restart", lambda b: b.device.restart(), events=("boot_changed",), boots=2),
    Fault(
        8,
        "counter reset, boot kept",
        lambda b: (b.play(1100), b.device.restart(keep_boot=True)),
        events=("boot_changed",),
        boots=2,
    ),
    Fault(
        9,
        "clock fast by 0.1 %",
        lambda b: (setattr(b.device, "drift_ppm", 1000.0), b.play(5600)),
        events=("clock_drift",),
        figures={"drift_ppm": (900.0, 1100.0)},
    ),
    Fault(10, "clock jumps ahead", lambda b: b.device.jump_clock(0.5), events=("clock_jump",)),
    Fault(10, "clock jumps back", lambda b: b.device.jump_clock(-0.5), events=("clock_jump",)),
    Fault(11, "stuck sensor", sensor(stuck, 150), flags={quality.STUCK: 51}, before=120),
    Fault(13, "saturation", sensor(rail, 5), flags={quality.SATURATED: 3}),
    Fault(
        15,
        "range left",
        sensor(lambda codes: codes.__iadd__(20000), 300),
        events=("implausible",),
        channel="high = 8000.0",
        figures={"flagged_saturated": (290, 300)},
    ),
    Fault(16, "half the rate", lambda b: at_half_the_rate(b, 150), events=("slow", "running")),
    Fault(
        17,
        "spike",
        sensor(lambda codes: codes.__iadd__(15000), 1),
        flags={quality.SPIKE: 1},
        channel="spike_above = 5000.0",
    ),
]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Callable[[Fault], SerialBench]]:
    benches = []

    def open_bench(fault: Fault) -> SerialBench:
        def config(port: str):  # type: ignore[no-untyped-def]
            return config_of(f'adapter = "serial"\nport = "{port}"', position=fault.channel)

        benches.append(SerialBench(tmp_path, config, fault.first_seq, "rig*"))
        return benches[-1]

    yield open_bench
    for bench in benches:
        bench.close()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: f"{fault.number}-{fault.name}")
def test_fault(fault: Fault, opened: Callable[[Fault], SerialBench]) -> None:
    bench = opened(fault)
    bench.settle(fault.before)
    fault.inject(bench)
    bench.settle(120)
    bench.time.pass_by(1.0)
    bench.running.tick()
    heard = bench.heard
    assert fault.lost[0] <= heard.lost() <= fault.lost[1]
    assert set(fault.events) <= set(heard.events())
    assert len({boot for boot, _ in heard.numbers()}) == fault.boots
    for name, (low, high) in fault.figures.items():
        assert low <= heard.health.counters[name] <= high, name
    flags = np.concatenate([block.channel("position").quality for block in heard.blocks])
    for flag, count in fault.flags.items():
        assert np.count_nonzero(flags & flag) == count
    if fault.boots == 1:
        every_sample_is_delivered_once_or_told(bench)


def every_sample_is_delivered_once_or_told(bench: SerialBench) -> None:
    numbers = [seq for _, seq in bench.heard.numbers()]
    told = [seq for gap in bench.heard.of(Gap) for seq in range(gap.first, gap.last + 1)]
    assert sorted([*numbers, *told]) == list(range(numbers[0], numbers[-1] + 1))
    assert bench.heard.health.counters["lost_samples"] == len(told)


def test_silence_is_noticed_within_a_tenth_of_a_second(
    opened: Callable[[Fault], SerialBench],
) -> None:
    bench = opened(FAULTS[0])
    bench.settle(20)
    bench.silence(0.09)
    assert "stale" not in bench.heard.events()
    bench.silence(0.02)
    assert bench.heard.health.state == "stale"


def test_wrong_baud_rate_is_called_that(opened: Callable[[Fault], SerialBench]) -> None:
    bench = opened(FAULTS[0])
    bench.faults.start("garbage")
    bench.play(300)
    assert bench.heard.count() == 0
    assert bench.heard.health.state == "garbage"
    assert "wrong baud rate, or not a device of rigwatch?" in bench.heard.text("garbage")


def test_a_port_in_use_is_refused(opened: Callable[[Fault], SerialBench]) -> None:
    bench = opened(FAULTS[0])
    second = SerialPort(str(bench.line.link), 115200)
    with pytest.raises(DeviceBusyError, match="in use by another process"):
        second.open()


def test_another_number_of_channels_is_named(tmp_path: Path) -> None:
    def four(port: str):  # type: ignore[no-untyped-def]
        return config_of(f'adapter = "serial"\nport = "{port}"', channels=4)

    bench = SerialBench(tmp_path, four)
    bench.play(20)
    bench.close()
    assert bench.heard.count() == 0
    assert "the device sends 3 channels, the configuration has 4" in bench.heard.text("link_lost")

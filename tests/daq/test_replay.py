"""A recording in place of a device."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from daq.acquisition import Acquisition
from daq.adapter import RawBlock
from daq.adapters.replay import ReplayAdapter
from rigwatch.simulated import sensor_channels, write_session
from rigwatch.wire.errors import DeviceError
from rigwatch.wire.messages.message_types import Column, SampleBlock
from rigwatch.wire.rig_config import ChannelSection
from rigwatch.wire.session import SessionWriter, open_session, run_info
from sim_plant.parameters import RigParameters
from tests.daq.rig import HostTime, config_of

SCENARIO = Path(__file__).parents[2] / "configs" / "scenarios" / "healthy_sine_8hz_1v4.toml"
CHANNELS = sensor_channels(RigParameters())


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("replay") / "two_seconds.mcap"
    write_session(out, SCENARIO, seconds=2.0)
    return out


def played(adapter: ReplayAdapter, time: HostTime, seconds: float) -> list[RawBlock]:
    adapter.open()
    blocks: list[RawBlock] = []
    end = time.ns + round(seconds * 1e9)
    while time.ns < end:
        blocks += adapter.read(0.01)
    return blocks


def replayed(
    session: Path, speed: float = 1.0, *, loop: bool = False
) -> tuple[ReplayAdapter, HostTime]:
    time = HostTime()
    adapter = ReplayAdapter(session, CHANNELS, speed, loop=loop, clock=time, sleep=time.pass_by)
    return adapter, time


def joined(blocks: Sequence[SampleBlock], name: str) -> np.ndarray:
    return np.concatenate([block.channel(name).values for block in blocks])


@pytest.mark.parametrize("speed", [1.0, 7.0])
def test_samples_come_back_bit_for_bit_and_on_time(session: Path, speed: float) -> None:
    adapter, time = replayed(session, speed)
    start = time.ns
    blocks = played(adapter, time, 2.5 / speed)
    assert sum(map(len, blocks)) == 512
    assert blocks[-1].arrived_ns[-1] - start == pytest.approx(511 / 256 / speed * 1e9, abs=2e7)
    config = config_of(f'adapter = "replay"\nsession = "{session}"')
    acquisition = Acquisition(config, adapter.clock_rate, host_offset_ns=lambda: 10**18)
    found = [m for raw in blocks for m in acquisition.update(raw) if isinstance(m, SampleBlock)]
    recorded = list(open_session(session).samples())
    assert [b.boot for b in found[:1]] == [recorded[0].boot]
    for name in ("voltage", "position", "acceleration"):
        np.testing.assert_array_equal(joined(found, name), joined(recorded, name))
    device_us = np.concatenate([block.device_us for block in found])
    np.testing.assert_array_equal(device_us, np.concatenate([b.device_us for b in recorded]))


def test_the_end_is_silence_or_the_start_again(session: Path) -> None:
    adapter, time = replayed(session)
    assert sum(map(len, played(adapter, time, 5.0))) == 512
    adapter, time = replayed(session, loop=True)
    blocks = played(adapter, time, 5.0)
    assert len({block.boot for block in blocks}) == 3
    assert adapter.counters()["turns"] == 3


@pytest.mark.parametrize("speed", [1.0, 10.0])
@pytest.mark.parametrize("second_us", [0, 3_000_000_000])
@pytest.mark.parametrize("pause_s", [3.0, -100.0])
def test_a_device_that_started_anew_in_the_recording_goes_on_in_time(
    tmp_path: Path, second_us: int, pause_s: float, speed: float
) -> None:
    """After a pause; a host whose clock was set back meanwhile does not tell how long it was."""
    boots = ((1, 50_000_000, 0.0), (2, second_us, 2.0 + pause_s))
    with SessionWriter(tmp_path / "000001.mcap", run_info("r", 256.0, t_ns=1)) as writer:
        for boot, first_us, at_s in boots:
            us = np.arange(512) * 1_000_000 // 256
            t_ns = 10**18 + round(at_s * 1e9) + us * 1000
            column = Column("x", "m", np.zeros(512), np.zeros(512, np.uint8))
            writer.write(SampleBlock("rig", boot, 0, first_us + us, t_ns, (column,)))
    time = HostTime()
    channel = ChannelSection(name="x", unit="m", gain=1.0)
    adapter = ReplayAdapter(tmp_path, [channel], speed, clock=time, sleep=time.pass_by)
    start = time.ns
    blocks = played(adapter, time, 8.0 / speed)
    came = {raw.boot: [] for raw in blocks}
    for raw in blocks:
        came[raw.boot] += ((raw.arrived_ns - start) * 1e-9 * speed).tolist()
    begins = 2.0 + max(pause_s, 0.0)
    for boot, wanted in ((1, 0.0), (2, begins)):
        np.testing.assert_allclose(came[boot], wanted + np.arange(512) / 256, atol=0.02 * speed)


@pytest.mark.parametrize(
    ("channel", "message"),
    [
        (("speed", "m/s"), "no channel 'speed', found voltage, position, acceleration"),
        (("position", "mm"), r"channel 'position' is in \[m\], expected \[mm\]"),
    ],
)
def test_channels_that_do_not_fit_are_named(
    session: Path, channel: tuple[str, str], message: str
) -> None:
    wrong = ChannelSection(name=channel[0], unit=channel[1], gain=1.0)
    with pytest.raises(DeviceError, match=message):
        ReplayAdapter(session, [wrong]).open()


def test_a_session_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"gone\.mcap"):
        ReplayAdapter(tmp_path / "gone.mcap", CHANNELS).open()

"""Channels swapped and units wrong from the start, on a real line: told, and nothing is learnt."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.faults.field import GAINS, RATE, Field, SerialDevice, WaveSource

pytestmark = pytest.mark.xdist_group("faults-supervised")


class SwappedSource(WaveSource):
    """The first two channels are connected the wrong way round."""

    def _one(self, number: int, index: int):  # type: ignore[no-untyped-def]
        return super()._one(number, index)[:, [1, 0, 2]]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Field, int]]:
    folder: Path = tmp_path_factory.mktemp("wired")
    section = f'adapter = "serial"\nport = "{folder}/line"'
    # The sensor's range is a thousandth of what the channel delivers.
    keys = {"voltage": f"low = -0.002\nhigh = {1000 * GAINS['voltage']!r}"}
    with Field(folder, section, keys=keys) as made:
        device = SerialDevice(folder / "line", SwappedSource())
        made.start("monitor")
        made.beside(device.serve)
        made.start("daq")
        made.judged(device.device.boot, 0)
        yield made, device.device.boot


def test_14_swapped_channels(rig: tuple[Field, int]) -> None:
    field, boot = rig
    alarm = field.raised("wiring_swapped")
    first = min(block.seq for block in field.estimates() if block.boot == boot)
    assert alarm.seq - first <= 5 * RATE
    field.judged(boot, alarm.seq + 512)
    later = [b for b in field.estimates() if b.boot == boot and b.seq > alarm.seq]
    assert all(block.column("armed").values.max() == 0.0 for block in later)
    assert field.journalled("departure") == []


def test_15_a_wrong_unit(rig: tuple[Field, int]) -> None:
    field, boot = rig
    event = field.event("implausible")
    assert "channel voltage is mostly outside of its range: wrong unit" in event.text
    first = next(block for block in field.estimates() if block.boot == boot)
    assert event.t_ns - first.t_ns[0] <= 2.1e9, "told once a second, after the first of samples"
    alarm = field.raised("sensor_saturated.voltage")
    assert alarm.seq - first.seq <= RATE

"""Channels swapped and units wrong from the start, on a real line: told, and nothing is learnt."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from monitor.model import load_model, model_versions
from tests.bus.rig import rigwatch
from tests.faults.field import GAINS, RATE, Field, SerialDevice, WaveSource, least_of
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("faults-supervised")


class SwappedSource(WaveSource):
    """The first two channels are connected the wrong way round."""

    def _one(self, number: int, index: int):  # type: ignore[no-untyped-def]
        return super()._one(number, index)[:, [1, 0, 2]]


class AmplifiedSource(WaveSource):
    """The amplifier of the accelerometer is set to four times its gain."""

    def _one(self, number: int, index: int):  # type: ignore[no-untyped-def]
        return super()._one(number, index) * [1.0, 1.0, 4.0]


class WeakSource(WaveSource):
    """The drive's channel is read in a unit that is ten times too large."""

    def _one(self, number: int, index: int):  # type: ignore[no-untyped-def]
        return super()._one(number, index) * [0.1, 1.0, 1.0]


def wired(folder: Path, source: WaveSource, keys: dict[str, str]) -> Iterator[tuple[Field, int]]:
    """A rig with its wiring from the first sample on, and the boot of its device."""
    section = f'adapter = "serial"\nport = "{folder}/line"'
    with Field(folder, section, keys=keys) as made:
        device = SerialDevice(folder / "line", source)
        made.start("monitor")
        made.beside(device.serve)
        made.start("daq")
        made.judged(device.device.boot, 0)
        yield made, device.device.boot


def test_14_swapped_channels(tmp_path: Path) -> None:
    for field, boot in wired(tmp_path, SwappedSource(), {}):
        alarm = field.raised("wiring_swapped")
        first = min(block.seq for block in field.estimates() if block.boot == boot)
        assert alarm.seq - first <= 5 * RATE
        nothing_is_judged(field, boot, alarm.seq)


def nothing_is_judged(field: Field, boot: int, since: int) -> None:
    """No sample of the boot is used for a verdict, before or after the alarm; nothing is learnt."""
    field.judged(boot, since + 512)
    found = [block for block in field.estimates() if block.boot == boot]
    assert all(block.column("armed").values.max() == 0.0 for block in found)
    assert field.journalled("departure") == []
    assert field.journalled("reference_learnt") == []


@pytest.mark.nightly
def test_15_a_drive_in_the_wrong_unit(tmp_path: Path) -> None:
    for field, boot in wired(tmp_path, WeakSource(), {}):
        alarm = field.raised("wiring_drive")
        first = min(block.seq for block in field.estimates() if block.boot == boot)
        assert alarm.value > alarm.high == 5.0
        assert alarm.seq - first <= 2 * RATE, "two windows of motion"
        nothing_is_judged(field, boot, alarm.seq)


def accepted(field: Field, name: str) -> "subprocess.CompletedProcess[str]":
    path = str(field.rig.path)
    return rigwatch("accept", path, name, "--user", "ann", "--text", "an amplifier of 4")


@pytest.fixture
def loud(tmp_path: Path) -> Iterator[tuple[Field, int]]:
    yield from wired(tmp_path, AmplifiedSource(), {})


@pytest.mark.nightly
def test_15_a_wiring_that_a_person_accepts_is_watched_also_after_a_kill(
    loud: tuple[Field, int],
) -> None:
    field, boot = loud
    field.raised("wiring_scale")
    refused = accepted(field, "wiring_sign")
    assert refused.returncode == 1
    assert "found no alarm 'wiring_sign' of the wiring whose condition holds" in refused.stderr
    assert all(block.column("armed").values.max() == 0.0 for block in field.estimates())

    done = accepted(field, "wiring_scale")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("in force from sample ")
    eventually(lambda: armed_after(field, boot, 0) > 0, "the rig is watched")
    field.cleared("wiring_scale")
    step = model_versions.history(field.folder / "model.toml")[-1]
    assert (step.step, step.user, step.why) == ("accept", "ann", "an amplifier of 4")
    assert load_model(field.folder / "model.toml").accepted_wiring == ("wiring_scale",)

    field.kill("monitor")
    since = max(block.seq for block in field.estimates())
    field.start("monitor")
    eventually(lambda: armed_after(field, boot, since + 512) > 0, "the next run watches it")
    assert not field.journalled("wiring_scale")[-1].active


def armed_after(field: Field, boot: int, seq: int) -> int:
    """Samples from a number on that were used for a verdict."""
    found = [block for block in field.estimates() if block.boot == boot and block.seq >= seq]
    return int(sum(block.column("armed").values.sum() for block in found))


@pytest.fixture(scope="module")
def amplified(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Field, int]]:
    # The voltage's range is a thousandth of what the channel delivers.
    keys = {"voltage": f"low = -0.002\nhigh = {1000 * GAINS['voltage']!r}"}
    yield from wired(tmp_path_factory.mktemp("amplified"), AmplifiedSource(), keys)


def test_15_a_wrong_unit(amplified: tuple[Field, int]) -> None:
    field, boot = amplified
    scale = field.raised("wiring_scale")
    first = min(block.seq for block in field.estimates() if block.boot == boot)
    assert scale.value == pytest.approx(4.0, rel=0.05)
    assert scale.seq - first <= 2 * RATE, "two windows of motion"
    saturated = field.raised("sensor_saturated.voltage")
    assert saturated.seq - first <= RATE
    nothing_is_judged(field, boot, scale.seq)


def test_15_a_range_that_cannot_be(amplified: tuple[Field, int]) -> None:
    field, boot = amplified

    def told() -> float:
        """From the first sample of this daq to its event [s]."""
        began = field.started_ns["daq"]
        event = field.event("implausible", began)
        text = "channel voltage is mostly outside of its range: wrong unit"
        assert text in event.text
        stamps = np.concatenate([b.t_ns for b in field.estimates() if b.boot == boot])
        return float(event.t_ns - stamps[stamps > began].min()) * 1e-9

    def again() -> None:
        field.kill("daq")
        field.start("daq")

    least_of(told, 1.0, again)

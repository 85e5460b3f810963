"""Faults inside the samples, which no converter gives: a recording is played to daq and monitor."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from scipy.signal import lfilter

from monitor.model import RigModel, TransferPlant
from rigwatch.physics.transfer import velocity_filter
from rigwatch.wire.messages import NON_FINITE, Column, SampleBlock
from rigwatch.wire.session import SessionWriter, run_info
from rigwatch.wire.wiring_names import WIRING
from tests.bus.publisher import wave
from tests.faults.field import RATE, Field
from tests.monitor_process.model import MODEL

pytestmark = pytest.mark.xdist_group("faults-serial")
BOOT, END = 9, 1280
NOT_A_NUMBER, HUGE, IMPOSSIBLE = 600, 650, 700
RESONANT = TransferPlant(b=(0.0, 0.0, 1e3), a=(1.0, -2.0 * np.cos(np.pi / 16.0), 1.0 - 1e-9))
"""Stable, and driven at its resonance: its output grows for an hour."""


def played(folder: Path, model: RigModel, **edited: np.ndarray) -> Iterator[Field]:
    """A rig to which a healthy wave is played, with other values in some channels."""
    whole = wave(0, END, BOOT, 10**18)
    columns = tuple(
        Column(c.name, c.unit, edited.get(c.name, c.values), np.zeros(END, np.uint8))
        for c in whole.channels
    )
    path = folder / "played.mcap"
    with SessionWriter(path, run_info("bench", RATE, t_ns=10**18)) as writer:
        writer.write(SampleBlock("rig", BOOT, 0, whole.device_us, whole.t_ns, columns))
    section = f'adapter = "replay"\nsession = "{path}"\nspeed = 3.0'
    unwired = "".join(f"[monitor.alarms.{name}]\nenabled = false\n" for name in WIRING)
    with Field(folder, section, model=model, extra=unwired) as made:
        made.start("monitor")
        made.start("daq")
        made.judged(BOOT, END - 1)
        yield made


def test_37_motion_that_cannot_tell_the_frictions_apart(tmp_path: Path) -> None:
    velocity = MODEL.velocity
    b, a = velocity_filter(velocity.corner, RATE, velocity.sensor_corner).padded()
    speed = np.where(np.arange(END) % 32 < 16, 0.2, -0.2)
    for rig in played(tmp_path, MODEL, acceleration=lfilter(a, b, speed)):
        alarm = rig.raised("ill_conditioned")
        assert alarm.value > MODEL.decision.worst_condition == 1e8
        for name in ("theta1", "theta2"):
            assert (column(rig, name) == 0.0).all(), "held at what was known before"
        assert column(rig, "armed")[alarm.seq] == 1.0
        assert alarm.seq - int(np.argmax(column(rig, "armed"))) <= 8, "with the first estimate"


def test_39_a_model_whose_filter_grows_without_limit(tmp_path: Path) -> None:
    for rig in played(tmp_path, structs.replace(MODEL, plant=RESONANT)):
        alarm = rig.raised("monitor_reset")
        modelled = column(rig, "modelled_acceleration")
        assert np.isfinite(modelled).all()
        assert np.abs(modelled).max() <= 1e9
        beyond = np.flatnonzero(np.abs(modelled) > 0.5e9)[0]
        assert 0 <= alarm.seq - beyond <= RATE, "within a second of leaving the limit"
        (record,) = [one for one in rig.journalled("monitor_reset") if one.active][:1]
        assert record.latched
        assert rig.event("MONITOR RESET")


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Field]:
    channels = {c.name: c.values.copy() for c in wave(0, END, BOOT, 0).channels}
    channels["acceleration"][NOT_A_NUMBER] = np.nan
    channels["voltage"][HUGE], channels["voltage"][IMPOSSIBLE] = 1e300, 9e8
    yield from played(tmp_path_factory.mktemp("replayed"), MODEL, **channels)


def column(rig: Field, name: str) -> np.ndarray:
    blocks = [b for b in rig.estimates() if b.boot == BOOT]
    return np.concatenate([b.column(name).values for b in blocks])


def test_12_a_sample_that_is_no_number(rig: Field) -> None:
    alarm = rig.raised("sensor_non_finite.acceleration")
    assert alarm.seq == NOT_A_NUMBER, "with the sample"
    values, flags = rig.read("acceleration", BOOT, NOT_A_NUMBER - 1, NOT_A_NUMBER + 1)
    assert flags.tolist() == [0, NON_FINITE, 0], "that sample is invalid"
    assert values[0] == values[1] != values[2], "the last value is held"
    residual = column(rig, "residual")
    assert np.isfinite(residual).all(), "it has entered no filter"
    assert np.abs(residual[NOT_A_NUMBER + 1 : HUGE]).max() < 2.0 * np.abs(residual[400:600]).max()


def test_38_a_number_that_no_filter_can_hold(rig: Field) -> None:
    alarm = rig.raised("monitor_reset")
    assert alarm.seq - IMPOSSIBLE <= 1, "with the sample that the model answers; 1e300 is held off"
    assert f"at sample {alarm.seq} " in rig.event("MONITOR RESET").text
    for name in ("modelled_acceleration", "residual", "velocity", "theta1", "theta2"):
        assert np.isfinite(column(rig, name)).all()
    armed = column(rig, "armed")
    assert armed[IMPOSSIBLE - 1] == 1.0
    assert armed[alarm.seq : alarm.seq + 32].max() == 0.0, "it starts anew"
    assert armed[-1] == 1.0

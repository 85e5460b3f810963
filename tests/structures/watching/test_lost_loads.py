"""A load that is measured and lost for some samples: missing alike in a file and on line."""

import numpy as np
import pytest

from rigwatch.structures.live.live_watch import LiveDamage, LiveSettings
from rigwatch.structures.model import to_model
from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.model.description import Structure
from rigwatch.structures.records.growing_record import GrowingRecord
from rigwatch.structures.records.record import Record
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages.message_types import Alarm, Column, SampleBlock
from sim_plant.structure import Damage, simulate, with_noise
from tests.structures.test_damage import FRAME

DT, LOST = 0.01, [130, 131, 340]
"""Time between samples [s]; samples of the wind that are lost."""
MEASURED = FRAME[: FRAME.index("sines")] + 'channel = "wind"\n'


@pytest.fixture(scope="module")
def frame(tmp_path_factory: pytest.TempPathFactory) -> Structure:
    path = tmp_path_factory.mktemp("measured") / "frame.toml"
    path.write_text(MEASURED, encoding="utf-8")
    return load_structure(path)


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Record:
    """Two positions of a frame whose top softens at 4 s, and the wind without some samples."""
    path = tmp_path_factory.mktemp("driven") / "frame.toml"
    path.write_text(FRAME, encoding="utf-8")
    softer = Damage(4.0, {"springs.top.stiffness": 30.0})
    made = with_noise(simulate(path, DT, 8.0, damages=[softer]), {"x1": 0.01, "x2": 0.01}, 3)
    time = np.arange(len(made.columns["x1"])) * DT
    wind = 40 * np.sin(9 * time) + 30 * np.sin(23 * time + 1.0)
    wind[LOST] = np.nan
    return Record(DT, {"x1": made.columns["x1"], "x2": made.columns["x2"], "wind": wind})


def block(record: Record, first: int, last: int) -> SampleBlock:
    numbers = np.arange(first, last)

    def column(name: str, values: FloatArray) -> Column:
        return Column(name, "", values[numbers], np.zeros(len(numbers), np.uint8))

    columns = tuple(column(name, values) for name, values in record.columns.items())
    return SampleBlock("frame", 7, first, numbers * 10_000, numbers * 10_000_000, columns)


@pytest.mark.parametrize("size", [1, 7, 400])
def test_a_lost_load_is_missing_on_line_as_it_is_in_a_file(frame: Structure, size: int):
    random = np.random.default_rng(1)
    wind, x1, x2 = random.normal(size=(3, 400))
    wind[[0, 5, 6, 90, 399]] = wind[200:240] = x1[50] = np.nan
    whole, model = Record(DT, {"x1": x1, "x2": x2, "wind": wind}), to_model(frame)
    growing, settled = GrowingRecord(DT, ("x1", "x2"), ("wind",)), np.zeros((0, 1))
    for first in range(0, 400, size):
        growing.take(block(whole, first, min(first + size, 400)))
        assert np.array_equal(growing.inputs[: len(settled)], settled)
        settled = growing.inputs[: growing.settled].copy()
    found = whole.recording(model)
    np.testing.assert_array_equal(growing.inputs, found.inputs)
    signals = found.outputs[:, [list(model.outputs).index(name) for name in ("x1", "x2")]]
    np.testing.assert_array_equal(growing.observed, signals)
    assert growing.settled == 399
    assert np.isnan(growing.observed).sum() == 2 * 45 + 1
    np.testing.assert_allclose(found.inputs[5:7, 0], np.interp([5, 6], [4, 7], wind[[4, 7]]))
    assert (found.inputs[200:240, 0] == wind[199]).all()
    assert growing.record(400).recording(model).inputs.tobytes() == found.inputs.tobytes()


def test_a_load_of_which_much_is_lost_is_refused(frame: Structure):
    still = np.zeros(400)
    wind = np.where(np.arange(400) % 4, still, np.nan)
    with pytest.raises(ModelError, match="found 25% of the load 'wind' missing, expected at most"):
        Record(DT, {"x1": still, "wind": wind}).recording(to_model(frame))


def test_lost_loads_alarm_nobody_and_hide_no_damage(frame: Structure, record: Record):
    live = LiveDamage(frame, DT, LiveSettings(known=True))
    said = live.update(block(record, 0, 450))
    (alarm,) = [message for message in said if isinstance(message, Alarm)]
    assert 400 < alarm.seq < 420

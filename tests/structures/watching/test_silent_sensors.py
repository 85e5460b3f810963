"""Sensors that say nothing while the structure is undamaged: no noise is known to judge them by."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigwatch.structures.damage.examination import Settings, examine
from rigwatch.structures.live import live_watch
from rigwatch.structures.live.live_watch import LiveDamage, LiveSettings
from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.model.description import Structure
from rigwatch.structures.records.record import Record
from rigwatch.structures.report import damage_report, damage_words
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages.message_types import Alarm, Column, EstimateBlock, Event, SampleBlock
from sim_plant.structure import Damage, simulate, with_noise
from tests.structures.test_damage import FRAME

SIGNALS = ("x1", "x2")
DAMAGE = Damage(6.0, {"springs.top.stiffness": 40.0})


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("frame") / "frame.toml"
    path.write_text(FRAME, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def frame(file: Path) -> Structure:
    return load_structure(file)


def record(file: Path, damages: list[Damage], **silent: float) -> Record:
    """Ten seconds; signals named in `silent` read that value for the first four of them."""
    made = simulate(file, 0.01, 10.0, damages=damages)
    columns = dict(with_noise(made, dict.fromkeys(SIGNALS, 0.02), 5).columns)
    for name, value in silent.items():
        columns[name][:400] = value
    return Record(0.01, {name: columns[name] for name in SIGNALS})


def blocks(whole: Record) -> Iterator[SampleBlock]:
    for first in range(0, len(whole), 50):
        at = np.arange(first, min(first + 50, len(whole)))
        columns = (
            Column(n, "m", c[at], np.zeros(len(at), np.uint8)) for n, c in whole.columns.items()
        )
        yield SampleBlock("frame", 7, first, at * 10_000, at * 10_000_000, tuple(columns))


@pytest.mark.parametrize("value", [np.nan, 0.0])
def test_a_sensor_that_comes_late_raises_no_alarm_and_is_named(
    file: Path, frame: Structure, value: float
) -> None:
    found = examine(frame, record(file, [], x1=value), Settings(known=True, undamaged=2.0))
    assert found.damages == ()
    assert found.watches[0].alarm is None
    assert found.reference.model.signals == ("x2",)
    assert found.reference.unjudged == ("x1",)
    assert "x1: no undamaged noise" in damage_words.remark(found)
    assert "x1: no undamaged noise" in damage_report.page(found, "late")


def test_the_others_still_find_the_damage(file: Path, frame: Structure) -> None:
    late = record(file, [DAMAGE], x1=np.nan)
    found = examine(frame, late, Settings(known=True, undamaged=2.0))
    assert [place.name for place in found.damages[0].ranking.changed] == ["top"]
    assert found.damages[0].instant.time == pytest.approx(6.0, abs=0.3)


def test_a_record_without_any_undamaged_sensor_is_refused(file: Path, frame: Structure) -> None:
    silent = record(file, [], x1=np.nan, x2=0.0)
    with pytest.raises(ModelError, match="found no undamaged sensor of x1, x2 with 20 samples"):
        examine(frame, silent, Settings(known=True, undamaged=2.0))


def test_live_watches_the_others_and_says_so(file: Path, frame: Structure) -> None:
    live = LiveDamage(frame, 0.01, LiveSettings(known=True))
    said = [m for part in blocks(record(file, [], x1=np.nan)) for m in live.update(part)]
    assert [m for m in said if isinstance(m, Alarm)] == []
    (event,) = [m for m in said if isinstance(m, Event)]
    assert (event.code, event.severity) == ("WATCHED", "warning")
    assert "x1: no undamaged noise" in event.text
    estimate = next(m for m in said if isinstance(m, EstimateBlock))
    assert [column.name for column in estimate.columns] == ["residual_x2", "statistic"]


def test_kernels_are_compiled_before_the_first_sample(
    frame: Structure, monkeypatch: pytest.MonkeyPatch
) -> None:
    stepped, step = list[int](), live_watch._UndamagedRun.step

    def counted(*arguments: Any) -> Any:
        stepped.append(arguments[2])
        return step(*arguments)

    monkeypatch.setattr(live_watch._UndamagedRun, "step", counted)
    LiveDamage(frame, 0.01, LiveSettings()).prepare()
    assert stepped

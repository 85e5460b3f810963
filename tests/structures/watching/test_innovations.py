"""Figures learnt from a short start of a nonlinear structure: false alarms stay at their rate."""

import re
from pathlib import Path

import numpy as np
import pytest

from rigwatch.structures.damage.detector import Judge
from rigwatch.structures.damage.examination import Settings, examine
from rigwatch.structures.damage.innovations import Innovations
from rigwatch.structures.damage.undamaged_reference import Reference, reference
from rigwatch.structures.live.live_watch import LiveDamage, LiveSettings, Said
from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.model.description import Structure, coefficients
from rigwatch.structures.records.record import Record
from rigwatch.wire.messages.message_types import Alarm, Column, Event, SampleBlock
from sim_plant.structure import Damage, StructureRecord, simulate, with_noise

UNDAMAGED = 1.0
STIFFENING = """
name = "frame"
summary = "Two storeys; the lower spring stiffens."
[nodes]
1.mass = 1.0
2.mass = 1.5
[springs.lower]
between = ["1"]
stiffness = { value = 400.0, unknown = true, guess = 350.0 }
cubic = { value = 8000.0, unknown = true, guess = 7200.0 }
[springs.upper]
between = ["1", "2"]
stiffness = { value = 300.0, unknown = true, guess = 320.0 }
[springs.top]
between = ["2"]
stiffness = 60.0
[dampers]
air = { between = ["2"], damping = 0.05 }
[loads.wind]
node = "2"
sines = [{ amplitude = 40.0, omega = 9.0 }, { amplitude = 30.0, omega = 23.0, phase = 1.0 }]
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("stiffening") / "frame.toml"
    path.write_text(STIFFENING, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def structure(file: Path) -> Structure:
    return load_structure(file)


def noisy(made: StructureRecord, seed: int) -> Record:
    columns = with_noise(made, {"x1": 0.1, "x2": 0.1}, seed, normal=True).columns
    return Record(0.01, {name: columns[name] for name in ("x1", "x2")})


def learnt(structure: Structure, record: Record) -> Reference:
    return reference(structure, record, UNDAMAGED)


@pytest.mark.nightly
def test_an_undamaged_nonlinear_structure_alarms_as_often_as_asked(
    file: Path, structure: Structure
) -> None:
    made, alarms = simulate(file, 0.01, 10.0), 0
    for seed in range(40):
        record = noisy(made, seed)
        base = learnt(structure, record)
        watch = Judge(base.sigma, base.samples, 0.05).watch(
            base.model, base.parameters, base.model.start(), 0, len(record), spread=base.spread,
            learnt=base.samples,
        )  # fmt: skip
        alarms += watch.alarm is not None
    # With 5 % a record, more than five of forty have a chance of 1.4 %.
    assert alarms <= 5


def test_its_innovations_are_white(file: Path, structure: Structure) -> None:
    made, found = simulate(file, 0.01, 6.0), []
    for seed in range(100, 120):
        record = noisy(made, seed)
        base = learnt(structure, record)
        start = base.model.start()
        filtered = Innovations(base.model, base.parameters, start, base.spread, base.sigma)
        found.append(filtered.along(base.model, 0, len(record), base.samples)[base.samples :])
    whole = np.array(found)
    # The noise itself is known to 5 % from a hundred samples of two signals.
    assert np.mean(whole**2) == pytest.approx(1.0, abs=0.06)
    assert abs(np.mean(whole[:, 1:] * whole[:, :-1])) < 0.03


@pytest.mark.parametrize("spring", ["lower", "upper"])
def test_a_softer_spring_is_found_all_the_same(
    file: Path, structure: Structure, spring: str
) -> None:
    value = coefficients(structure)[spring].value
    damage = Damage(4.0, {f"springs.{spring}.stiffness": 0.6 * value})
    record = noisy(simulate(file, 0.01, 10.0, damages=[damage]), 3)
    found = examine(structure, record, Settings(undamaged=UNDAMAGED))
    assert [d.ranking.best.name for d in found.damages] == [spring]


@pytest.mark.nightly
def test_a_structure_that_moves_at_the_first_sample_is_watched_all_the_same(
    file: Path, structure: Structure
) -> None:
    # Recorded loads tell the time, which a file's sines cannot.
    text = file.read_text().partition("sines = ")[0] + 'channel = "wind"\n'
    pushed = file.with_name("pushed.toml")
    pushed.write_text(text, encoding="utf-8")
    time = np.arange(1401) * 0.01
    wind = 40 * np.sin(9 * time) + 30 * np.sin(23 * time + 1)
    damage = Damage(9.0, {"springs.upper.stiffness": 180.0})
    made = simulate(pushed, 0.01, 14.0, recorded={"wind": wind}, damages=[damage])
    columns = with_noise(made, {"x1": 0.02, "x2": 0.02}, 5, normal=True).columns
    live = LiveDamage(load_structure(pushed), 0.01, LiveSettings())
    said = list[Said]()
    for first in range(300, 1400, 50):
        numbers = np.arange(first, first + 50)
        signals = tuple(Column(n, "", columns[n][numbers]) for n in ("x1", "x2", "wind"))
        block = SampleBlock("frame", 1, first, numbers * 10_000, numbers * 10_000_000, signals)
        said += live.update(block)
    assert [m.code for m in said if isinstance(m, Event)] == ["WATCHED", "DAMAGE"]
    assert re.search(r"lower = [\d.]+ N/m, lower_cubic = [\d.]+ N/m\^3", said_of(said)[0])
    (alarm,) = [m for m in said if isinstance(m, Alarm)]
    assert 900 <= alarm.seq < 930
    assert said_of(said)[1].startswith("upper softer at")


def said_of(said: list[Said]) -> list[str]:
    return [message.text for message in said if isinstance(message, Event)]

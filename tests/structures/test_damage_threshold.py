from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigwatch.structures.damage.detector import Judge
from rigwatch.structures.damage.onset import instant
from rigwatch.structures.damage.spring_model import spring_model, with_record
from rigwatch.structures.damage.threshold import (
    FORGETTING,
    CumulativeSum,
    false_alarm,
    threshold_for,
)
from rigwatch.structures.damage.undamaged_reference import reference
from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.records.record import Record
from sim_plant.structure import Damage, simulate

SIGNALS, SAMPLES = 4, 300


def share_of_alarms(threshold: float, records: int, calibration: int) -> float:
    random = np.random.default_rng(7)
    total, alarmed = np.zeros(records), np.zeros(records, bool)
    sigma = np.ones((records, SIGNALS))
    if calibration:
        trial = random.standard_normal((records, calibration, SIGNALS))
        sigma = np.sqrt(np.mean(trial**2, axis=1))
    for _ in range(SAMPLES):
        energy = np.sum((random.standard_normal((records, SIGNALS)) / sigma) ** 2, axis=1)
        total = np.maximum(0.0, total + energy - FORGETTING * SIGNALS)
        alarmed |= total > threshold
    return float(alarmed.mean())


@pytest.mark.parametrize("calibration", [0, 150])
def test_noise_alone_alarms_as_often_as_calculated(calibration: int) -> None:
    threshold = threshold_for(0.1, SIGNALS, SAMPLES, calibration)
    # 4000 records: one standard deviation is 0.5 %.
    assert share_of_alarms(threshold, 4000, calibration) == pytest.approx(0.1, abs=0.025)


@settings(max_examples=15, deadline=None)
@given(rate=st.floats(1e-4, 0.5), signals=st.integers(1, 12), samples=st.integers(10, 2000))
def test_the_threshold_has_the_rate_that_was_asked_for(
    rate: float, signals: int, samples: int
) -> None:
    threshold = threshold_for(rate, signals, samples)
    assert false_alarm(threshold, signals, samples) == pytest.approx(rate, rel=0.02)


def test_an_uncertain_noise_asks_for_a_higher_threshold() -> None:
    assert threshold_for(0.01, 8, 1000, 50) > threshold_for(0.01, 8, 1000, 500)
    assert threshold_for(0.01, 8, 1000, 500) > threshold_for(0.01, 8, 1000)


def test_a_missing_sample_moves_nothing_up() -> None:
    adding = CumulativeSum(SIGNALS, 10.0)
    adding.value = 5.0
    assert not adding.update(np.full(SIGNALS, np.nan))
    assert adding.value == pytest.approx(5.0 - (FORGETTING - 1.0) * SIGNALS)


def test_the_onset_is_where_the_sum_left_zero() -> None:
    adding = CumulativeSum(1, 20.0)
    steps = [0.1, 0.1, 3.0, 3.0, 3.0]
    alarms = [adding.update(np.array([step])) for step in steps]
    assert alarms == [False, False, False, False, True]
    assert adding.zero == 3


FRAME = """
name = "frame"
summary = "Two storeys of which neither stiffness nor damping is known, seen at both."
[nodes]
1.mass = 1.0
2.mass = 1.5
[springs]
lower = { between = ["1"], stiffness = { value = 400.0, unknown = true } }
upper = { between = ["1", "2"], stiffness = { value = 300.0, unknown = true } }
top = { between = ["2"], stiffness = { value = 60.0, unknown = true } }
[dampers]
air = { between = ["2"], damping = { value = 0.5, unknown = true } }
[loads.wind]
node = "2"
sines = [{ amplitude = 40.0, omega = 9.0 }, { amplitude = 30.0, omega = 23.0, phase = 1.0 }]
"""


def test_the_noise_does_not_seem_less_by_what_was_identified_from_it(tmp_path: Path) -> None:
    path = tmp_path / "frame.toml"
    path.write_text(FRAME, encoding="utf-8")
    structure, made = load_structure(path), simulate(path, 0.02, 1.0)
    names, random = ("x1", "x2"), np.random.default_rng(5)
    true = 0.02 * np.array([made.columns[name].std() for name in names])
    ratios = []
    for _ in range(40):
        columns = {
            name: made.columns[name] + size * random.standard_normal(len(made.columns[name]))
            for name, size in zip(names, true, strict=True)
        }
        # 24 samples of two signals, and eight unknowns: all stiffnesses, damping and first states.
        found = reference(structure, Record(0.02, columns), 0.48, moving=True)
        ratios.append(np.mean((found.sigma / true) ** 2))
        assert found.freedom == 24 - 8 // 2
    # One standard deviation of the mean is 0.035.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)


KNOWN = FRAME.replace(", unknown = true", "")


@pytest.mark.nightly
def test_a_small_damage_is_dated_with_an_interval_that_holds_its_instant(tmp_path: Path) -> None:
    path = tmp_path / "frame.toml"
    path.write_text(KNOWN, encoding="utf-8")
    structure, names = load_structure(path), ("x1", "x2")
    made = simulate(path, 0.01, 9.0, damages=[Damage(4.0, {"springs.top.stiffness": 54.0})])
    sigma = 0.15 * np.array([simulate(path, 0.01, 4.0).columns[name].std() for name in names])
    random, held, model = np.random.default_rng(1), [], None
    for _ in range(30):
        columns = {
            name: made.columns[name] + size * random.standard_normal(len(made.columns[name]))
            for name, size in zip(names, sigma, strict=True)
        }
        record = Record(0.01, columns)
        model = with_record(model, record) if model else spring_model(structure, record)
        start = model.problem.start
        watch = Judge(sigma, 400).watch(model, start, model.start(), 0, len(model))
        assert watch.alarm is not None
        damaged = model.changed(start, {"top": 54.0})
        found = instant(model, damaged, watch, watch.alarm, sigma)
        held.append(found.low <= 4.0 <= found.high)
        assert found.high - found.low < 1.0
    assert np.mean(held) >= 0.85

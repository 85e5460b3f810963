"""A linear black box that runs free: what it leaves of a healthy recording is no effect."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.fit.healthy_reference import _starts
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Accepted
from tests.workbench.black_box import TEMPLATE, record
from tests.workbench.black_box import study as made

FREE = 'prediction = "free"\n' + TEMPLATE.read_text(encoding="utf-8")


def study(folder: Path, text: str = FREE) -> Study:
    return made(folder, text)


def test_a_healthy_rig_has_nothing_missing(tmp_path):
    record(tmp_path, "healthy", 1)
    record(tmp_path, "rig", 2)
    bench = open_bench(study(tmp_path))
    assert bench.floor.ratio(bench.base.held_out) < 1.1
    assert any("6 healthy periods" in remark for remark in bench.data.remarks)
    assert ranking(bench)[1].word == "nothing_missing"


@pytest.mark.nightly
def test_drag_shows_above_what_the_box_leaves_anyway(tmp_path):
    record(tmp_path, "healthy", 1)
    record(tmp_path, "rig", 2, viscous=0.1)
    bench = open_bench(study(tmp_path))
    assert bench.floor.ratio(bench.base.held_out) > 2
    _, verdict = ranking(bench)
    assert "viscous@load" in (*verdict.members, *verdict.rivals)


def test_recordings_that_start_elsewhere_in_the_period_are_aligned(tmp_path):
    record(tmp_path, "healthy", 1)
    record(tmp_path, "rig", 2)
    text = FREE.replace("end = 12.0", "start = 1.37\nend = 13.37")
    bench = open_bench(study(tmp_path, text))
    assert bench.floor.ratio(bench.base.train) < 1.1


@pytest.mark.parametrize(
    ("phases", "cut", "words"),
    [(2, "", "excitation 0 times"), (1, "[[healthy]]", "found no healthy recording")],
)
def test_without_the_same_excitation_it_says_what_is_needed(tmp_path, phases, cut, words):
    record(tmp_path, "healthy", 1, phases)
    record(tmp_path, "rig", 2)
    with pytest.raises(ModelError, match=words):
        open_bench(study(tmp_path, FREE.split(cut)[0] if cut else FREE))


def test_a_period_must_hold_whole_horizons(tmp_path):
    record(tmp_path, "healthy", 1)
    record(tmp_path, "rig", 2)
    text = FREE.replace("horizon = 0.5", "horizon = 0.6")
    with pytest.raises(ModelError, match="multiple of the horizon"):
        open_bench(study(tmp_path, text))


@pytest.mark.long
@pytest.mark.nightly
def test_two_faults_at_once_are_named_whichever_is_found_first(tmp_path):
    record(tmp_path, "healthy", 1)
    record(tmp_path, "rig", 2, viscous=0.15, acceleration_lag=0.002)
    _, verdict = ranking(open_bench(study(tmp_path)))
    named = {*verdict.members, *verdict.rivals, *verdict.second}
    assert {"viscous@load", "lag@acceleration_sensor"} <= named
    assert verdict.word in {"missing_effect", "undetermined"}


@pytest.mark.nightly
def test_an_effect_that_cannot_vanish_does_not_raise_the_floor(tmp_path):
    record(tmp_path, "healthy", 1)
    record(tmp_path, "rig", 2, actuator_delay=0.001)
    opened = study(tmp_path)
    alone = open_bench(opened)
    added = open_bench(opened.with_effects([Accepted(effect="lag", port="drive")]))
    assert (added.floor.rms <= alone.floor.rms * (1 + 1e-9)).all()
    assert added.base.held_out_error < alone.base.held_out_error


def test_an_input_about_a_large_value_is_compared_by_how_it_moves() -> None:
    n = np.arange(600)
    period = 5.0 + 0.3 * np.sin(2 * np.pi * n[:100] / 100)
    same, other = 5.0 + 0.3 * np.sin(2 * np.pi * (n - 30) / 100), 5.0 + 0.3 * np.sin(n / 3.0)
    assert _starts(period[:, None], same[:, None]).tolist() == [30, 130, 230, 330, 430]
    assert not len(_starts(period[:, None], other[:, None]))
    both = np.column_stack([same, other])
    assert not len(_starts(np.column_stack([period, period]), both)), "the second input differs"
    still = np.column_stack([same, np.full(len(n), 2.0)])
    assert len(_starts(np.column_stack([period, np.full(100, 2.0)]), still)) == 5

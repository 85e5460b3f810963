"""A log whose rows have the command that acted until then is put in order before it is judged."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare.compare import comparison
from rigwatch.workbench.compare.preparation import bench_of
from rigwatch.workbench.compare.row_order import with_row_order
from rigwatch.workbench.data.next_rows import with_next_rows
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.report.text_report import fit_lines
from rigwatch.workbench.study.edits import keep_holds
from rigwatch.workbench.study.study import Study, open_study, study_of
from rigwatch.workbench.study.study_file import Accepted, Span, StudyFile
from sim_plant.oscillator import RATE, Hidden, oscillate

SAMPLES, HORIZON, NOISE = 2560, 256, 2e-3
HELD = structs.replace(shipped_models()["mass-spring-damper"], hold="zero")


def force_of(seed):
    time, lines = np.arange(SAMPLES) / RATE, np.arange(0.25, 12, 0.25)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    return 4 * np.cos(2 * np.pi * np.outer(time, lines) + phases).mean(axis=1) * np.sqrt(len(lines))


def recorded(seed, hidden=(), *, before=False):
    """A recording; `before`: a row has the force that acted until then."""
    force = force_of(seed)
    size = oscillate(force, (), np.zeros(2), 0, held=True).std(axis=0)
    read = oscillate(force, hidden, NOISE * size, seed, held=True)
    written = np.concatenate([force[:1], force[:-1]]) if before else force
    return Recording(1 / RATE, written[:, None], read), NOISE * size


def made(*hidden, before=False):
    span = (Span(session="simulated"),)
    file = StudyFile(model="mass-spring-damper", train=span, held_out=span)
    (train, scale), (held_out, _) = (recorded(seed, hidden, before=before) for seed in (1, 2))
    study = Study(Path(), file, HELD, library(), frozenset())
    return study, Data(train, held_out, None, HORIZON, ()), scale


def test_a_row_with_the_command_until_then_is_found_and_reported():
    study, data, scale = made(before=True)
    assert ranking(bench_of(study, data, scale))[1].word != "nothing_missing"
    bench = bench_of(*with_row_order(study, data), scale)
    assert bench.study.holds["force"].late == -1.0
    assert any("a sample late" in line for line in fit_lines(comparison(bench)))
    assert ranking(bench)[1].word == "nothing_missing"


def test_a_missing_effect_is_named_once_the_rows_are_in_order():
    study, data, scale = made(Hidden("coulomb", 0.15), before=True)
    verdict = ranking(bench_of(*with_row_order(study, data), scale))[1]
    assert (verdict.word, verdict.best.label) == ("missing_effect", "coulomb@load")


@pytest.mark.parametrize("hidden", [
    None, Hidden("coulomb", 0.15), Hidden("backlash", 0.01), Hidden("position_lag", 0.01),
    Hidden("delay", 0.01), Hidden("dead_band", 0.3),
])  # fmt: skip
def test_rows_in_order_stay_whatever_is_missing(hidden):
    study, data, _ = made(*([hidden] if hidden else []))
    assert with_row_order(study, data) == (study, data)


def test_with_an_order_or_an_effect_in_the_study_none_is_tried():
    study, data, _ = made(before=True)
    told = replace(study, file=structs.replace(study.file, late={"force": 0.0}))
    assert with_row_order(told, data) == (told, data)
    accepted = (Accepted(effect="coulomb", port="load", parameters={"Fc": 0.1}),)
    further = replace(study, file=structs.replace(study.file, effects=accepted))
    assert with_row_order(further, data) == (further, data)


def test_each_recording_keeps_its_last_value():
    recording = Recording(0.1, np.arange(6.0)[:, None], np.zeros((6, 2)), parts=(4, 2))
    moved = with_next_rows(HELD, recording, ["force"])
    assert moved.inputs[:, 0].tolist() == [1, 2, 3, 3, 5, 5]
    assert with_next_rows(HELD, recording, []) is recording


def test_a_study_keeps_the_order_that_was_found(tmp_path):
    (tmp_path / "model.toml").write_text(
        'name = "m"\nsummary = "."\nhold = "zero"\ninputs.u = { unit = "N" }\n'
        'states.v = { unit = "m/s", derivative = "(u - c*v)/m", measured = "speed" }\n'
        'parameters.m = { value = 1.0, unit = "kg", low = 0.1 }\n'
        'parameters.c = { value = 1.0, unit = "N s/m" }\n'
        'outputs.speed = { unit = "m/s", expression = "v" }\n'
    )
    text = 'model = "model.toml"\ntrain = [{ session = "a" }]\nheld_out = [{ session = "b" }]\n'
    (tmp_path / "study.toml").write_text("late = { u = -1 }\n" + text)
    given = open_study(tmp_path)
    assert given.holds["u"].ends
    assert given.model.inputs["u"].late == 0.0
    found = replace(given.holds["u"], source="the recordings")
    kept = keep_holds(replace(study_of(tmp_path, text), holds={"u": found}))
    assert kept.holds["u"].ends
    assert kept.file.late == {"u": -1.0}

"""What inputs do between samples is chosen from the data, said, kept, and can be given."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare.compare import comparison
from rigwatch.workbench.compare.preparation import bench_of
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.fit.input_hold import with_hold, with_holds
from rigwatch.workbench.report.text_report import fit_lines
from rigwatch.workbench.study.edits import keep_holds
from rigwatch.workbench.study.study import Study, open_study
from rigwatch.workbench.study.study_file import Accepted, Span, StudyFile
from sim_plant.oscillator import RATE, Hidden, oscillate

SAMPLES, HORIZON, NOISE = 2560, 256, 2e-3


def force_of(seed):
    time, lines = np.arange(SAMPLES) / RATE, np.arange(0.25, 12, 0.25)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    return 4 * np.cos(2 * np.pi * np.outer(time, lines) + phases).mean(axis=1) * np.sqrt(len(lines))


def recorded(seed, held, hidden=()):
    force = force_of(seed)
    size = oscillate(force, (), np.zeros(2), 0, held=held).std(axis=0)
    read = oscillate(force, hidden, NOISE * size, seed, held=held)
    return Recording(1 / RATE, force[:, None], read), NOISE * size


def study(**more):
    span = (Span(session="simulated"),)
    file = StudyFile(model="mass-spring-damper", train=span, held_out=span, **more)
    model = shipped_models()["mass-spring-damper"]
    return Study(Path(), file, model, library(), frozenset())


def data(held, *, hidden=(), healthy=False):
    train, scale = recorded(1, held, hidden)
    beside = recorded(3, held)[0] if healthy else None
    return Data(train, recorded(2, held, hidden)[0], beside, HORIZON, ()), scale


@pytest.mark.parametrize("healthy", [True, False])
@pytest.mark.parametrize(("held", "hold"), [(True, "zero"), (False, "linear")])
def test_it_is_chosen_and_nothing_is_missing(held, hold, healthy):
    given, scale = data(held, healthy=healthy)
    bench = bench_of(study(), given, scale)
    found = comparison(bench)
    assert found.hold["force"].hold == hold
    assert found.hold["force"].late == 0.0
    assert any("force" in line and "chosen from" in line for line in fit_lines(found))
    assert found.convergence is not None
    assert found.convergence.converged
    assert ranking(bench)[1].word == "nothing_missing"


def test_recordings_that_contradict_each_other_do_not_choose_a_hold():
    (train, scale), (held_out, _) = recorded(1, held=False), recorded(2, held=True)
    bench = bench_of(study(), Data(train, held_out, None, HORIZON, ()), scale)
    assert bench.study.holds["force"].hold == "linear"


def test_what_is_held_and_late_by_a_part_of_a_sample_is_found_and_reported():
    late = 0.4
    model = with_holds(shipped_models()["mass-spring-damper"], {"force": ("zero", late)})
    made = []
    for seed in (1, 2):
        force = force_of(seed)
        run = compile_system(compose(model)).simulate(
            force[:, None], 1 / RATE, np.zeros(1, np.int64), SAMPLES, initial=np.zeros((1, 2)),
            parameters=np.array([0.8, 1.5, 60.0]), substeps=8,
        )  # fmt: skip
        scale = NOISE * run.outputs[0].std(axis=0)
        noise = scale * np.random.default_rng(seed).normal(size=(SAMPLES, 2))
        made.append(Recording(1 / RATE, force[:, None], run.outputs[0] + noise))
    bench = bench_of(study(), Data(made[0], made[1], None, HORIZON, ()), scale)
    held = bench.study.holds["force"]
    assert held.hold == "zero"
    assert held.late == pytest.approx(late, abs=0.02)
    assert held.seconds == pytest.approx(late / RATE, abs=0.02 / RATE)
    assert any("ms" in line for line in fit_lines(comparison(bench)))


def test_an_input_that_is_late_changes_in_the_middle_of_an_interval():
    model = shipped_models()["mass-spring-damper"]
    step = np.concatenate([np.zeros(5), np.ones(15)])[:, None]
    values = np.array([1.0, 0.0, 0.0])
    for late in (0.0, 0.25, 1.0):
        compiled = compile_system(compose(with_holds(model, {"force": ("zero", late)})))
        run = compiled.simulate(
            step, 0.1, np.zeros(1, np.int64), 20, initial=np.zeros((1, 2)), parameters=values
        )
        since = np.maximum(np.arange(20) - 5 - late, 0) * 0.1
        assert run.outputs[0, :, 0] == pytest.approx(since**2 / 2, abs=1e-12)
        # The force that acts at a sample is that of before where it changes late.
        assert run.outputs[0, 5, 1] == (1.0 if late == 0 else 0.0)


def test_a_fault_does_not_pass_for_a_hold_where_there_is_a_healthy_recording():
    given, scale = data(False, hidden=(Hidden("delay", 0.5 / RATE),), healthy=True)
    bench = bench_of(study(), given, scale)
    assert bench.study.holds["force"].hold == "linear"
    assert bench.study.holds["force"].source == "the healthy recording"
    assert "delay@drive" in ranking(bench)[1].members


def test_what_the_model_file_says_is_left_alone():
    given, scale = data(True)
    model = structs.replace(shipped_models()["mass-spring-damper"], hold="linear")
    assert model.unheld() == ()
    told = with_hold(replace(study(), model=model), given, scale)
    assert told.model.held("force") == "linear"


def test_a_study_can_give_it_and_keeps_what_was_chosen(tmp_path):
    spans = "".join(f'{use} = [{{ session = "a" }}]\n' for use in ("train", "held_out"))
    text = f'model = "mass-spring-damper"\n{spans}'
    (tmp_path / "study.toml").write_text(
        f'hold = {{ force = "zero" }}\nlate = {{ force = 0.3 }}\n{text}'
    )
    opened = open_study(tmp_path)
    assert (opened.model.held("force"), opened.model.inputs["force"].late) == ("zero", 0.3)
    assert opened.holds["force"].source == "the study"
    (tmp_path / "study.toml").write_text(text)
    given, scale = data(True)
    chosen = with_hold(open_study(tmp_path), given, scale)
    kept = keep_holds(chosen)
    assert kept.model.held("force") == "zero"
    assert kept.file.hold == {"force": "zero"}


def test_a_digital_filter_at_a_drive_needs_an_input_that_is_held():
    from rigwatch.physics.engine.score.compatibility import suits

    model = shipped_models()["mass-spring-damper"]
    effect = library()["digital_smoothing"]
    assert not suits(effect, model.ports["drive"], model)
    assert suits(effect, model.ports["position_sensor"], model)
    assert suits(effect, model.ports["drive"], structs.replace(model, hold="zero"))


def smoothed(clean):
    found = np.zeros(len(clean))
    for k in range(1, len(clean)):
        found[k] = (0.4 * found[k - 1] + clean[k]) / 1.4
    return found


def averaged(clean):
    return np.convolve(clean, np.ones(3) / 3)[: len(clean)]


@pytest.mark.parametrize(
    ("name", "strength", "expected", "first"),
    [("digital_smoothing", 0.4, smoothed, 1), ("moving_average", 3.0, averaged, 3)],
)
def test_a_digital_filter_is_exact_at_the_samples(name, strength, expected, first):
    model = structs.replace(shipped_models()["mass-spring-damper"], hold="zero")
    placement = Placement(name, library()[name], "acceleration_sensor")
    compiled = compile_system(compose(model, [placement]))
    force = force_of(5)[:400, None]
    plain = compile_system(compose(model))
    values = {"m": 0.8, "c": 1.5, "k": 60.0}
    more = {placement.prefix + placement.effect.strength: strength}
    clean = plain.simulate(
        force, 1 / RATE, np.zeros(1, np.int64), 400, initial=np.zeros((1, 2)),
        parameters=plain.vector(values), substeps=4,
    ).outputs[0, :, 1]  # fmt: skip
    run = compiled.simulate(
        force, 1 / RATE, np.zeros(1, np.int64), 400,
        initial=np.zeros((1, len(compiled.system.states))),
        parameters=compiled.vector(values | more), substeps=4,
    )  # fmt: skip
    assert run.outputs[0, first:, 1] == pytest.approx(expected(clean)[first:], abs=1e-9)


def test_effects_that_were_accepted_do_not_disturb_the_hold_of_the_healthy_recording():
    (train, scale), (held_out, _), (healthy, _) = (recorded(seed, held=True) for seed in range(3))
    accepted = Accepted(effect="constant_force", port="load", parameters={"F0": 0.1})
    known = with_hold(
        study(effects=(accepted,)), Data(train, held_out, healthy, HORIZON, ()), scale
    )
    assert known.holds["force"].source == "the healthy recording"

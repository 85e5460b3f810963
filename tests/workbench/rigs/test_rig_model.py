"""The analytic model of the rig against the simulated rig, whose equations are others."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare.preparation import bench_of, determined_by_healthy
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.fit.fitted_model import fit_base
from rigwatch.workbench.fit.healthy_parameters import with_healthy_parameters
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile
from sim_plant.excitation import Multisine, drive
from sim_plant.parameters import INCH, RigParameters
from sim_plant.rig import Rig

RIG = RigParameters()
SHORT_AND_WIDE = RigParameters(
    bore=0.75 * INCH, stroke=2.0 * INCH, port_area=6.0, port_resistance=6e8
)
"""The same rig with another cylinder: four times the area, less than half the stroke."""
SAMPLES = 2560
NOISE = np.array(
    [
        np.hypot(RIG.lvdt_noise, RIG.lvdt_resolution / np.sqrt(12)),
        np.hypot(RIG.accelerometer_noise, RIG.si_per_code[2] / np.sqrt(12)),
    ]
)


def recorded(
    seed: int, parameters: RigParameters = RIG, volts: float = 2.5, **effects: float
) -> Recording:
    rig = Rig(parameters, seed)
    for name, value in effects.items():
        rig.set_effect(name, value)
    excitation = Multisine(amplitude=volts, start=0.5, stop=12.0, seed=seed)
    source = drive(excitation, parameters.sample_rate)
    rig.advance(source(np.arange(1024)))
    si = rig.advance(source(np.arange(1024, 1024 + SAMPLES))).codes * parameters.si_per_code
    return Recording(1 / parameters.sample_rate, si[:, :1].copy(), si[:, 1:].copy())


def shipped() -> Study:
    span = (Span(session="simulated"),)
    file = StudyFile(model="servo-pneumatic", train=span, held_out=span)
    return Study(Path(), file, shipped_models()["servo-pneumatic"], library(), frozenset())


@pytest.fixture(scope="module")
def study() -> Study:
    healthy = recorded(3)
    return with_healthy_parameters(shipped(), Data(healthy, healthy, healthy, 128, ()), NOISE)


def test_the_analytic_model_reaches_the_noise_of_the_sensors(study):
    fitted = fit_base(study, Data(recorded(1), recorded(2), None, 128, ()), NOISE)
    assert (fitted.held_out.rms < 1.1 * NOISE).all()


def test_what_a_healthy_recording_tells_is_not_fitted_away(study):
    leaking = Data(recorded(1, chamber_leak=0.004), recorded(2, chamber_leak=0.004), None, 128, ())
    held = fit_base(study, leaking, NOISE)
    assert (held.held_out.rms > 1.5 * NOISE).all()
    assert "Cs" not in held.compiled.system.free


def test_without_a_healthy_recording_nothing_is_moved(study):
    plain = replace(study, model=shipped_models()["servo-pneumatic"])
    assert (
        with_healthy_parameters(plain, Data(recorded(1), recorded(2), None, 128, ()), NOISE)
        is plain
    )


def test_the_healthy_recordings_tell_another_cylinder() -> None:
    healthy, *others = (recorded(seed, SHORT_AND_WIDE, 0.6) for seed in (2, 1, 3))

    found = bench_of(*determined_by_healthy(shipped(), Data(*others, healthy, 128, ())))

    for fitted in (found.base.train, found.base.held_out):
        assert (fitted.rms < 1.3 * NOISE[1]).all()
    area = found.study.model.parameters["A1"].value
    assert area == pytest.approx(SHORT_AND_WIDE.piston_area, rel=0.3)

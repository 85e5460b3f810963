"""A study of a motor whose resistance and torque constant are known, without a folder."""

from pathlib import Path

from msgspec import structs

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile


def motor_study(resistance: float, constant: float) -> Study:
    """The shipped model, started from a resistance [ohm] and a torque constant [N m/A]."""
    model = shipped_models()["motor"]
    known = {"R": resistance, "K": constant}
    parameters = {
        n: structs.replace(p, value=known.get(n, p.value)) for n, p in model.parameters.items()
    }
    span = (Span(session="simulated"),)
    file = StudyFile(model="motor", train=span, held_out=span)
    model = structs.replace(model, parameters=parameters)
    return Study(Path(), file, model, library(), frozenset())

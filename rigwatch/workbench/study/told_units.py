"""Units in which errors are told: that of the study, such as its logs' rpm, or of the model file.

Everything computes, and JSON and ledger state, errors in SI. This is the one place that converts
them for texts, tables and charts.
"""

from msgspec import structs

from rigwatch.physics.engine.equations import Model, Output
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.wire.units import UnitError, unit_of
from rigwatch.workbench.study.study_file import StudyFile

NOISES = "× channel noise"
"""In place of a unit, where several channels have one error."""


def told_unit(output: Output) -> str:
    """The unit in which an output's errors are told.

    A unit with a zero of its own is none of differences: degrees Celsius are told in kelvin.
    """
    wanted = output.shown or output.unit
    return output.unit if unit_of(wanted).offset else wanted


def told(value: float, unit: str) -> float:
    """An error in SI, or in noises, converted to the unit in which it is told."""
    return value if unit == NOISES else value / float(unit_of(unit).factor)


def with_shown_units(model: Model, file: StudyFile) -> Model:
    """The model with its outputs shown in the units that the study gives.

    Raises:
        ModelError: the study names an output that the model does not have, or a unit of another
            dimension.
    """
    outputs = dict(model.outputs)
    for name, unit in file.shown.items():
        if name not in outputs:
            raise ModelError(f"shown: found output {name!r}{nearest(name, outputs)}")
        try:
            outputs[name] = structs.replace(outputs[name], shown=unit)
        except UnitError as error:
            raise ModelError(f"shown.{name}: {error}") from None
    return structs.replace(model, outputs=outputs)

"""Parameters that are known of each recording, such as a load or the gain of a controller.

They differ from recording to recording and stay the same in each, as an input does that is kept;
so that is what they become, and nothing that simulates, fits or ranks knows the difference.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import structs

from rigwatch.physics.engine.equations import Input, Model
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.units import unit_of

if TYPE_CHECKING:
    from rigwatch.workbench.study.study import Span, StudyFile


def known_in_si(model: Model, file: "StudyFile", path: Path) -> "StudyFile":
    """The file with what is known of each recording in SI, every such parameter of every one.

    Args:
        model: as it was written.
        file: its `parameters` of recordings are in the units that people write; those that a
            recording does not give have the value of `start`, or of the model.
        path: of the file, for errors.

    Raises:
        ConfigError: a recording names a parameter that the model does not have.
    """
    names = _names(file)
    for name in names:
        if name not in model.parameters:
            known = ", ".join(model.parameters)
            raise ConfigError(path, "parameters", repr(name), f"parameters of the model: {known}")
    units = {n: unit_of(model.parameters[n].shown or model.parameters[n].unit) for n in names}
    usual = {
        n: float(units[n].to_si(file.start[n])) if n in file.start else model.parameters[n].value
        for n in names
    }

    def in_si(span: "Span") -> "Span":
        own = {n: float(units[n].to_si(value)) for n, value in span.parameters.items()}
        return structs.replace(span, parameters=usual | own)

    return structs.replace(
        file,
        train=tuple(map(in_si, file.train)),
        held_out=tuple(map(in_si, file.held_out)),
        healthy=tuple(map(in_si, file.healthy)),
        start={n: value for n, value in file.start.items() if n not in names},
    )


def known_as_inputs(model: Model, file: "StudyFile") -> Model:
    """The model with the parameters that are known of each recording as inputs."""
    names = _names(file)
    inputs = {n: Input(unit=model.parameters[n].unit, hold="zero") for n in names}
    left = {n: p for n, p in model.parameters.items() if n not in names}
    return structs.replace(model, inputs=model.inputs | inputs, parameters=left)


def _names(file: "StudyFile") -> list[str]:
    """Parameters that a recording gives."""
    spans = (*file.train, *file.held_out, *file.healthy)
    return list(dict.fromkeys(name for span in spans for name in span.parameters))

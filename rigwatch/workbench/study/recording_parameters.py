"""Parameters known for each recording, for example a load or a controller gain.

They differ between recordings and are constant within each. They are therefore treated as held
inputs, and simulation, fit and ranking need no special case.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import structs

from rigwatch.physics.engine.equations import Input, Model
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.units import unit_of

if TYPE_CHECKING:
    from rigwatch.workbench.study.study_file import Span, StudyFile


def known_in_si(model: Model, file: "StudyFile", path: Path) -> "StudyFile":
    """The file with every recording parameter of every recording, in SI.

    Args:
        model: the unmodified model.
        file: its recordings' `parameters` are in the units of the file; one that a recording does
            not give takes its value from `start` or from the model.
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
    """The model with its recording parameters turned into inputs."""
    names = _names(file)
    inputs = {n: Input(unit=model.parameters[n].unit, hold="zero") for n in names}
    left = {n: p for n, p in model.parameters.items() if n not in names}
    return structs.replace(model, inputs=model.inputs | inputs, parameters=left)


def _names(file: "StudyFile") -> list[str]:
    """Names of all parameters given by any recording."""
    spans = (*file.train, *file.held_out, *file.healthy)
    return list(dict.fromkeys(name for span in spans for name in span.parameters))

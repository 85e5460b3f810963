"""Parameters known for each recording, for example a load or a controller gain.

They differ between recordings and are constant within each. They are therefore treated as held
inputs, and simulation, fit and ranking need no special case.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from msgspec import structs

from rigwatch.physics.engine.equations import Input, Model, Parameter
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.units import unit_of
from rigwatch.workbench.study.study_file import Span, StudyFile

USES = ("train", "held_out", "healthy")


@dataclass(frozen=True)
class Known:
    """What is known of one recording.

    Attributes:
        use: "train", "held_out" or "healthy".
        session: its name in the study's file.
        values: of parameters, in `units`.
        units: of the parameters, as in the model file.
    """

    use: str
    session: str
    values: dict[str, float]
    units: dict[str, str]

    def __str__(self) -> str:
        return f"{self.session} ({self.use.replace('_', ' ')}): {self.in_words()}"

    def in_words(self) -> str:
        """The values with their units."""
        return ", ".join(
            f"{name} = {value:g} {self.units[name]}".rstrip() for name, value in self.values.items()
        )


def known_of(model: Model, file: StudyFile) -> tuple[Known, ...]:
    """What the study's file gives for single recordings, for an unmodified model."""
    return tuple(
        Known(use, span.session, span.parameters, _units(model, span))
        for use in USES
        for span in getattr(file, use)
        if span.parameters
    )


def _units(model: Model, span: Span) -> dict[str, str]:
    return {name: _unit(model.parameters[name]) for name in span.parameters}


def _unit(parameter: Parameter) -> str:
    return parameter.shown or parameter.unit


def known_in_si(model: Model, file: StudyFile, path: Path) -> StudyFile:
    """The file with every recording parameter of every recording, in SI.

    Args:
        model: the unmodified model.
        file: its recordings' `parameters` are in the units of the file; one that a recording does
            not give takes its value from `start` or from the model.
        path: of the file, for errors.

    Raises:
        ConfigError: a recording names a parameter that the model does not have, or does not give
            one that the model fits per recording while another recording gives it.
    """
    _check_names(model, file, path)
    _check_complete(model, file, path)
    names = given_names(file)
    units = {n: unit_of(_unit(model.parameters[n])) for n in names}
    usual = {
        n: float(units[n].to_si(file.start[n])) if n in file.start else model.parameters[n].value
        for n in names
    }

    def in_si(span: Span) -> Span:
        own = {n: float(units[n].to_si(value)) for n, value in span.parameters.items()}
        return structs.replace(span, parameters=usual | own)

    start = {n: value for n, value in file.start.items() if n not in names}
    return structs.replace(for_each_span(file, in_si), start=start)


def for_each_span(file: StudyFile, change: Callable[[Span], Span]) -> StudyFile:
    """The file with each recording's section changed."""
    changed = {use: tuple(map(change, getattr(file, use))) for use in USES}
    return structs.replace(file, **changed)


def _check_names(model: Model, file: StudyFile, path: Path) -> None:
    for key, span in _sections(file):
        for name, value in span.parameters.items():
            if name not in model.parameters:
                raise ConfigError(
                    path, f"{key}.parameters", repr(name),
                    f"parameters of the model: {', '.join(model.parameters)}",
                )  # fmt: skip
            if not math.isfinite(value):
                raise ConfigError(path, f"{key}.parameters.{name}", f"{value}", "a finite number")


def _check_complete(model: Model, file: StudyFile, path: Path) -> None:
    """A parameter that the model fits per recording is given in all of them or in none."""
    for name in given_names(file):
        missing = [key for key, span in _sections(file) if name not in span.parameters]
        if missing and model.parameters[name].per_recording:
            raise ConfigError(
                path, f"{missing[0]}.parameters", f"no {name}",
                "it in every recording or in none, since the model fits it per recording",
            )  # fmt: skip


def _sections(file: StudyFile) -> Iterator[tuple[str, Span]]:
    """The recordings' sections by their keys, counted from 0."""
    for use in USES:
        for index, span in enumerate(getattr(file, use)):
            yield f"{use}[{index}]", span


def known_as_inputs(model: Model, file: StudyFile) -> Model:
    """The model with its recording parameters turned into inputs."""
    names = [name for name in given_names(file) if name in model.parameters]
    inputs = {n: Input(unit=model.parameters[n].unit, hold="zero", constant=True) for n in names}
    left = {n: p for n, p in model.parameters.items() if n not in names}
    return structs.replace(model, inputs=model.inputs | inputs, parameters=left)


def given_names(file: StudyFile) -> list[str]:
    """Names of all parameters given by any recording."""
    return list(dict.fromkeys(name for _, span in _sections(file) for name in span.parameters))

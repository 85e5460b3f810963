"""Known parameters of a model, for example a mass, with the values that a study gives them.

A model file states its own value with a wide deviation, as it is written before the machine is
known. Whoever weighs the mass gives its value under `[start]` and its deviation under
`[deviation]`.
"""

from collections.abc import Iterator
from pathlib import Path

from msgspec import structs

from rigwatch.physics.engine.equations import Model, Parameter
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.workbench.study.study_file import StudyFile


def check_values(model: Model, file: StudyFile, path: Path) -> None:
    """Check that the values which a study gives are within the bounds of the model's parameters.

    Args:
        model: the unmodified model.
        file: as written, values in the units of the model file.
        path: of the file, for errors.

    Raises:
        ConfigError: one is not.
    """
    for key, name, value in _given(file):
        if name in model.parameters and (broken := model.parameters[name].bounds_broken(value)):
            raise ConfigError(path, f"{key}.{name}", f"{value:g}", broken)


def _given(file: StudyFile) -> Iterator[tuple[str, str, float]]:
    """Key of the table, parameter and value of all that a study's file gives."""
    yield from (("start", name, value) for name, value in file.start.items())
    for use in ("train", "held_out", "healthy"):
        for index, span in enumerate(getattr(file, use)):
            key = f"{use}[{index}].parameters"
            yield from ((key, name, value) for name, value in span.parameters.items())


def with_known_values(model: Model, file: StudyFile) -> Model:
    """The model with the values and deviations of its known parameters from the study.

    Args:
        model: the study's model.
        file: its `start` and `deviation` are in SI.

    Raises:
        ModelError: `deviation` names a parameter that is not a known one.
    """
    known = {n: p for n, p in model.parameters.items() if p.fixed and not p.kept}
    for name in file.deviation:
        if name not in known:
            raise ModelError(
                f"deviation: found {name!r}, expected a fixed parameter of {model.name}:"
                f" {', '.join(known) or 'it has none'}"
            )
    given = {name: _as_given(name, p, file) for name, p in known.items()}
    return structs.replace(model, parameters=model.parameters | given)


def assumed_values(model: Model, file: StudyFile) -> list[str]:
    """Names of the known parameters whose values are the model file's, not the study's."""
    known = [n for n, p in model.parameters.items() if p.fixed and not (p.kept or p.per_recording)]
    return [name for name in known if name not in file.start]


def _as_given(name: str, p: Parameter, file: StudyFile) -> Parameter:
    """The parameter; a value without a deviation is exact."""
    own = 0.0 if name in file.start else p.deviation
    deviation = file.deviation.get(name, own)
    return structs.replace(p, value=file.start.get(name, p.value), deviation=deviation)

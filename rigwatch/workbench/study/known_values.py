"""Known parameters of a model, for example a mass, with the values that a study gives them.

A model file states its own value with a wide deviation, as it is written before the machine is
known. Whoever weighs the mass gives its value under `[start]` and its deviation under
`[deviation]`.
"""

from msgspec import structs

from rigwatch.physics.engine.equations import Model, Parameter
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.study.study_file import StudyFile


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

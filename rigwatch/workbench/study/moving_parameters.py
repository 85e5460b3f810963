"""Parameters that a model fits for each recording, for example a zero that moves between runs.

A parameter `p` with `per_recording = true` becomes one parameter per session and a quantity,

    p = p_run1·in_run1 + p_run2·in_run2 + …

in which the held input `in_run1` is 1 in the session run1 and 0 elsewhere. Parts of one session
share a value. A session of which no part is fitted has a fixed parameter instead, since data that
judge may not fit: its value is fitted to its opening, which does not count
(`Data.openings`).
"""

import re
from pathlib import PurePath

from msgspec import structs

from rigwatch.physics.engine.equations import Input, Model, Parameter, Quantity
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.study.recording_parameters import for_each_span, given_names
from rigwatch.workbench.study.study_file import Span, StudyFile


def moving_names(model: Model, file: StudyFile) -> list[str]:
    """Parameters that the unmodified model fits per recording."""
    given = given_names(file)
    return [n for n, p in model.parameters.items() if p.per_recording and n not in given]


def judged_alone(file: StudyFile) -> list[str]:
    """Sessions that are held out and of which no part is fitted."""
    fitted = {span.session for span in file.train}
    return list(dict.fromkeys(s.session for s in file.held_out if s.session not in fitted))


def told_apart(model: Model, file: StudyFile) -> StudyFile:
    """The file with the inputs that tell recordings apart as known parameters of each.

    Args:
        model: the unmodified model.
        file: its recordings and initial values.
    """
    moving = moving_names(model, file)
    if not moving:
        return file
    if model.rough:
        raise ModelError(
            f"{model.name}: found per_recording at {moving[0]} of a rough model, expected a model"
            " that is not rough"
        )
    labels = _labels(file)
    own = {n: file.start[n] for n in moving if n in file.start}
    start = {n: value for n, value in file.start.items() if n not in own}
    start |= {_named(n, label): v for n, v in own.items() for label in labels.values()}

    def told(span: Span) -> Span:
        inside = {_input(label): 0.0 for label in labels.values()}
        inside[_input(labels[span.session])] = 1.0
        return structs.replace(span, parameters=span.parameters | inside)

    return structs.replace(for_each_span(file, told), start=start)


def fitted_by_recording(model: Model, file: StudyFile) -> Model:
    """The model with its moving parameters replaced by one per session.

    Raises:
        ModelError: a name that this needs is in use.
    """
    moving = moving_names(model, file)
    if not moving:
        return model
    labels, alone = _labels(file), set(judged_alone(file))
    inputs = {
        _input(label): Input(unit="1", hold="zero", constant=True) for label in labels.values()
    }
    own: dict[str, Parameter] = {}
    quantities = {}
    for name in moving:
        parameter = model.parameters[name]
        for session, label in labels.items():
            meaning = f"{parameter.meaning or name} in {session}"
            one = structs.replace(parameter, fixed=session in alone, meaning=meaning)
            own.setdefault(_named(name, label), one)
        terms = [f"{_named(name, label)}*{_input(label)}" for label in labels.values()]
        quantities[name] = Quantity(
            expression=" + ".join(dict.fromkeys(terms)),
            unit=parameter.unit,
            shown=parameter.shown,
        )
    _check_unused(model, (*inputs, *own))
    return structs.replace(
        model,
        inputs=model.inputs | inputs,
        parameters={n: p for n, p in model.parameters.items() if n not in moving} | own,
        quantities=quantities | model.quantities,
    )


def _labels(file: StudyFile) -> dict[str, str]:
    """An identifier for each session; healthy sessions share those of fitted ones.

    The healthy recordings are fitted on their own, so that they may. A parameter of their own would
    have no influence on the training.
    """
    fitted = list(dict.fromkeys(span.session for span in file.train))
    labels: dict[str, str] = {}
    for session in (*fitted, *judged_alone(file)):
        _add(labels, session)
    healthy = list(dict.fromkeys(span.session for span in file.healthy))
    free = [s for s in fitted if s not in healthy]
    for session in healthy:
        if session in labels:
            continue
        if free:
            labels[session] = labels[free.pop(0)]
        else:
            _add(labels, session)
    return labels


def _add(labels: dict[str, str], session: str) -> None:
    """Give a session a label that no other has."""
    name = re.sub(r"\W", "_", PurePath(session).stem)
    taken = set(labels.values())
    further = (f"{name}_{count}" for count in range(2, len(taken) + 3))
    labels[session] = next(n for n in (name, *further) if n not in taken)


def _named(parameter: str, label: str) -> str:
    return f"{parameter}_{label}"


def _input(label: str) -> str:
    return f"in_{label}"


def _check_unused(model: Model, names: tuple[str, ...]) -> None:
    tables = (model.inputs, model.states, model.parameters, model.quantities, model.outputs)
    used = {name for table in (*tables, model.ports) for name in table}
    if both := used & set(names):
        raise ModelError(
            f"{model.name}: found {min(both)!r}, which a parameter with per_recording needs for a"
            " recording of that name, expected another name in the model"
        )

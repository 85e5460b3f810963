"""Changes a study: adds an effect, removes the last one, takes a user's effect or model file.

Each change of the model is a trial (`trial.py`) and its commit; the ledger records all of them.
"""

from collections.abc import Sequence
from pathlib import Path

from rigwatch.physics.engine.equations import Effect, Model, Placement, compose, parse_effects
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files import read_text
from rigwatch.workbench.ranking import Progress, no_progress
from rigwatch.workbench.steps.trial import Change, try_add, try_undo
from rigwatch.workbench.study import (
    Study,
    commit,
    open_study,
    use_effect_file,
    use_model_file,
)


def add(
    study: Study,
    effect: str,
    port: str | None = None,
    *,
    anyway: bool = False,
    beside: Sequence[str] = (),
    progress: Progress = no_progress,
) -> Change:
    """Add an effect to the model if the held-out error supports it.

    Args:
        study: the study.
        effect: its name, or "effect@port".
        port: name of the port; optional if only one port is compatible.
        anyway: add it even if the held-out error does not fall.
        beside: other effects, as "effect@port", that are missing as well: if it is refused alone,
            it is added if the held-out error supports each effect of the whole set.
        progress: called with a line of text as each part begins.

    Raises:
        ModelError: effect or port is unknown or already there, the fit fails, or the study has been
            changed since it was opened.
    """
    return try_add(study, effect, port, anyway=anyway, beside=beside, progress=progress).commit()


def undo(study: Study, progress: Progress = no_progress) -> Change:
    """Remove the last effect or, if there is none, the variants of the model.

    Raises:
        ModelError: there is nothing to undo, or the study has been changed since it was opened.
    """
    return try_undo(study, progress).commit()


def learn(study: Study, path: Path) -> tuple[Study, list[str]]:
    """Copy a user's effect file into the study; the changed study and the effects' names.

    Raises:
        ConfigError: the file is invalid.
        ModelError: an effect fits none of the model's ports, or an accepted effect would change.
    """
    return learn_text(study, path.name, read_text(path), path)


def learn_text(
    study: Study, name: str, text: str, file: Path | None = None
) -> tuple[Study, list[str]]:
    """Write an own effect file into the study; the changed study and the effects' names.

    Args:
        study: the study.
        name: of the file in the study's folder.
        text: its content.
        file: named in errors; the file in the study's folder if None.

    Raises:
        ConfigError: the content is invalid.
        ModelError: an effect fits none of the model's ports, or an accepted effect would change.
    """
    file = file or study.folder / name
    found = parse_effects(text, file)
    for effect in found:
        check_effect(study.model, effect, found[effect], file)
    changed = use_effect_file(study, name, text)
    commit(study, changed, "effect-file", file=name, names=sorted(found))
    return open_study(study.folder), sorted(found)


def check_effect(model: Model, name: str, effect: Effect, file: Path) -> str:
    """Check an own effect at the first port of a model that it fits; returns the port.

    Raises:
        ModelError: there is none, or an expression is invalid there.
    """
    places = [port for port, own in model.ports.items() if effect.fits(own.kind)]
    if not places:
        raise ModelError(
            f"{file}: {name}: found port {effect.port!r}, expected one that {model.name} has"
        )
    compose(model, [Placement(name, effect, places[0])])
    return places[0]


def remodel(study: Study, name: str, text: str) -> Study:
    """Write an own model file into the study and use it; returns the changed study.

    Args:
        study: without accepted effects.
        name: of the file in the study's folder.
        text: its content.

    Raises:
        ConfigError: the content is invalid.
        ModelError: the model cannot be used, or effects have been accepted on the current one.
    """
    changed = use_model_file(study, name, text)
    commit(study, changed, "model-file", file=name)
    return open_study(study.folder)

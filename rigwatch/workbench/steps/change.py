"""Changes a study: adds an effect, removes the last one, loads a user's effect file.

Each change of the model is a trial (`trial.py`) and its commit; the ledger records all of them.
"""

from pathlib import Path

from rigwatch.physics.engine.equations import Placement, compose, load_effects
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.ranking import Progress, no_progress
from rigwatch.workbench.steps.trial import Change, try_add, try_undo
from rigwatch.workbench.study import Study, commit, use_effect_file


def add(
    study: Study,
    effect: str,
    port: str | None = None,
    *,
    anyway: bool = False,
    progress: Progress = no_progress,
) -> Change:
    """Add an effect to the model if the held-out error supports it.

    Args:
        study: the study.
        effect: its name.
        port: name of the port; optional if only one port is compatible.
        anyway: add it even if the held-out error does not fall.
        progress: called with a line of text as each part begins.

    Raises:
        ModelError: effect or port is unknown or already there, the fit fails, or the study has been
            changed since it was opened.
    """
    return try_add(study, effect, port, anyway=anyway, progress=progress).commit()


def undo(study: Study, progress: Progress = no_progress) -> Change:
    """Remove the last effect or, if there is none, the variants of the model.

    Raises:
        ModelError: there is nothing to undo, or the study has been changed since it was opened.
    """
    return try_undo(study, progress).commit()


def learn(study: Study, path: Path) -> tuple[Study, list[str]]:
    """Load a user's effect file into the study; the changed study and the effects' names.

    Raises:
        ConfigError: the file is invalid.
        ModelError: an effect fits none of the model's ports.
    """
    found = load_effects(path)
    for name, effect in found.items():
        places = [n for n, p in study.model.ports.items() if effect.fits(p.kind)]
        if not places:
            raise ModelError(
                f"{path}: {name}: found port {effect.port!r}, expected one that"
                f" {study.model.name} has"
            )
        compose(study.model, [Placement(name, effect, places[0])])
    changed = use_effect_file(study, path)
    commit(study, changed, "effect-file", file=path.name, names=sorted(found))
    return changed, sorted(found)

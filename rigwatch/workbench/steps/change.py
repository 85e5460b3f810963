"""Changes a study: adds an effect, takes the last one away, takes own effects in.

Each change of the model is a trial (`trial.py`) and its commit; the ledger keeps all of them.
"""

from pathlib import Path

from rigwatch.physics.engine.equations import Placement, compose, load_effects
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.ranking import Progress, unheard
from rigwatch.workbench.steps.trial import Change, try_add, try_undo
from rigwatch.workbench.study import Study, commit, use_effect_file


def add(
    study: Study,
    effect: str,
    port: str | None = None,
    *,
    anyway: bool = False,
    progress: Progress = unheard,
) -> Change:
    """Put an effect into the model, if the recordings held out speak for it.

    Args:
        study: the study.
        effect: its name.
        port: where; may be left out where only one port takes it.
        anyway: add it even though the held-out error does not fall.
        progress: told what begins.

    Raises:
        ModelError: effect or port is unknown or already there, the fit fails, or the study has been
            changed since it was opened.
    """
    return try_add(study, effect, port, anyway=anyway, progress=progress).commit()


def undo(study: Study, progress: Progress = unheard) -> Change:
    """Take the last effect away or, where there is none, the variants of the model.

    Raises:
        ModelError: there is nothing to undo, or the study has been changed since it was opened.
    """
    return try_undo(study, progress).commit()


def learn(study: Study, path: Path) -> tuple[Study, list[str]]:
    """Take the user's effect file into the study; its effects' names.

    Raises:
        ConfigError: the file does not fit.
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

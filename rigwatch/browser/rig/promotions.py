"""The versions of the model in a rig's monitor: who promoted what, when and from which study."""

import re
from dataclasses import dataclass
from pathlib import Path

from msgspec import structs

from monitor.model import model_versions
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.steps import ModelHandover, hand_over, model_path, restore
from rigwatch.workbench.study import FILE, open_study

_STUDY = re.compile(r"study ([^:]+)")


@dataclass(frozen=True)
class Promotion:
    """One change of the model.

    Attributes:
        t_ns: of the change [ns].
        step: "promote" or "rollback".
        user: who made it.
        identity: whether the user is proved, as the history has it.
        why: the reason, in words.
        study: name of the study in the served folder; empty if it is not there.
        in_force: whether the model that it installed is in force.
        sha256: of the model.
    """

    t_ns: int
    step: str
    user: str
    identity: str
    why: str
    study: str
    in_force: bool
    sha256: str


def promotions(rig: Path, root: Path) -> list[Promotion]:
    """The history of a rig's model, newest first.

    Raises:
        ConfigError: the rig's configuration or the history cannot be read.
    """
    path = model_path(rig)
    found = model_versions.history(path)
    now = model_versions.digest_of(path)
    last = max((k for k, one in enumerate(found) if one.sha256 == now), default=-1)
    return [
        Promotion(**structs.asdict(one), study=_study(root, one.why), in_force=number == last)
        for number, one in reversed(list(enumerate(found)))
    ]


def can_roll_back(rig: Path) -> bool:
    """Whether there is a previous model."""
    try:
        return bool(model_versions.version_before(model_path(rig)))
    except RigwatchError:
        return False


def study_in_force(rig: Path, root: Path) -> str:
    """Name of the study that the model in force is from; empty if it is from none.

    Raises:
        ConfigError: the rig's configuration or the history cannot be read.
    """
    path = model_path(rig)
    now = model_versions.digest_of(path)
    promoted = [
        one.why
        for one in model_versions.history(path)
        if one.step == "promote" and one.sha256 == now
    ]
    return _study(root, promoted[-1]) if promoted else ""


def roll_back(rig: Path, root: Path) -> ModelHandover:
    """Restore the previous model, with a line in the ledger of the study that is rolled back.

    Raises:
        ConfigError: there is no previous model.
    """
    study = study_in_force(rig, root)
    if study:
        return hand_over(open_study(root / study), rig, rollback=True)
    return restore(rig)


def _study(root: Path, why: str) -> str:
    found = _STUDY.search(why)
    name = found[1].strip() if found else ""
    plain = name and Path(name).name == name and name not in (".", "..")
    return name if plain and (root / name / FILE).is_file() else ""

"""What a study's page offers at a rig: rehearse, go live, roll back."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigwatch.browser.views.study_state import State


@dataclass(frozen=True)
class AtRig:
    """A rig's model, as a study's page needs it.

    Attributes:
        config: the rig's configuration.
        model: digest of the model in force.
        study: name of the study that the model in force is from; empty if it is from none.
        can_roll_back: whether there is a previous model.
    """

    config: Path
    model: str = ""
    study: str = ""
    can_roll_back: bool = False


def rehearsal_of(state: State, at: AtRig | None) -> dict[str, Any] | None:
    """The rehearsal of a step against the model in force; None if there is none."""
    found: dict[str, Any] | None = state.results.read("rehearsal") if at else None
    return found if at and found and found.get("against") == at.model else None


def falls(rehearsal: dict[str, Any] | None) -> bool:
    """Whether the monitor's residual is smaller with the rehearsed model."""
    sizes = [(rehearsal or {}).get(name) for name in ("after", "before")]
    return None not in sizes and sizes[0] < sizes[1]  # type: ignore[operator]


def in_force(state: State, at: AtRig | None) -> bool:
    """Whether the rig's model is that of the current study."""
    steps = [line.get("step") for line in state.ledger]
    changes = [step for step in steps if step in ("add", "undo", "base", "model-file", "promote")]
    return at is not None and at.study == state.name and changes[-1:] == ["promote"]

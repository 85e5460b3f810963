"""Steps on a study: add and undo effects, replay the ledger, promote a model to a monitor."""

from rigwatch.workbench.steps import change
from rigwatch.workbench.steps.change import Change, add, learn, undo
from rigwatch.workbench.steps.ledger_replay import replay
from rigwatch.workbench.steps.model_steps import Signals, Stage, signals, stages
from rigwatch.workbench.steps.promotion import promotion

__all__ = [
    "Change",
    "Signals",
    "Stage",
    "add",
    "change",
    "learn",
    "promotion",
    "replay",
    "signals",
    "stages",
    "undo",
]

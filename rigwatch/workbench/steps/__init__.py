"""Steps of a study: choose a base, add and undo effects, replay the ledger, promote the model."""

from rigwatch.workbench.steps import change
from rigwatch.workbench.steps.base import take_base
from rigwatch.workbench.steps.change import add, check_effect, learn, learn_text, remodel, undo
from rigwatch.workbench.steps.from_logs import study_from_logs
from rigwatch.workbench.steps.imported_logs import Logs
from rigwatch.workbench.steps.ledger_replay import replay
from rigwatch.workbench.steps.log_columns import suggested
from rigwatch.workbench.steps.model_handover import (
    ModelHandover,
    Rehearsal,
    hand_over,
    model_path,
    rehearse,
    restore,
)
from rigwatch.workbench.steps.promotion import promotion
from rigwatch.workbench.steps.study_stages import Signals, Stage, signals, stages
from rigwatch.workbench.steps.trial import (
    Change,
    Trial,
    accepted_with_model,
    try_add,
    try_effect,
    try_undo,
)

__all__ = [
    "Change",
    "Logs",
    "ModelHandover",
    "Rehearsal",
    "Signals",
    "Stage",
    "Trial",
    "accepted_with_model",
    "add",
    "change",
    "check_effect",
    "hand_over",
    "learn",
    "learn_text",
    "model_path",
    "promotion",
    "rehearse",
    "remodel",
    "replay",
    "restore",
    "signals",
    "stages",
    "study_from_logs",
    "suggested",
    "take_base",
    "try_add",
    "try_effect",
    "try_undo",
    "undo",
]

"""Hands a promoted model to a rig's monitor: live if it runs, otherwise by its model file.

Before a model goes live it can be rehearsed on the latest samples of the rig: the monitor runs over
them with the new model and with the model in force.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from monitor.model import RigModel, load_model, model_versions
from monitor.pipeline import RigMonitor
from monitor.process import monitor_section
from rigwatch.wire.access import operator_name
from rigwatch.wire.bus import (
    ModelReply,
    ModelRequest,
    ask_for_model,
    connect,
    proved_here,
    unique_process,
)
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import Alarm, SampleBlock
from rigwatch.wire.rig_config import RigConfig, load_rig
from rigwatch.workbench.steps.promotion import Promotion, promotion
from rigwatch.workbench.study import Study, ledger

LINK_TIMEOUT = 3.0


@dataclass(frozen=True)
class ModelHandover:
    """Outcome of a model change.

    Attributes:
        reply: the monitor's answer.
        live: whether a monitor is running.
        found: the promoted model; None for a rollback.
    """

    reply: ModelReply
    live: bool
    found: Promotion | None


@dataclass(frozen=True)
class Rehearsal:
    """Comparison of a new model with the model in force on the same samples.

    Attributes:
        seconds: length of the samples [s].
        before, after: the monitor's residual with the model in force and with the new one, rms.
        alarms: names of the alarms that the new model raises.
    """

    seconds: float
    before: float
    after: float
    alarms: tuple[str, ...]


def hand_over(
    study: Study,
    rig: Path,
    user: str = "",
    *,
    rollback: bool = False,
    say: Callable[[str], None] = lambda _: None,
) -> ModelHandover:
    """Promote a study's model to a rig's monitor, or restore the previous model.

    Args:
        study: the study whose accepted effects are promoted.
        rig: the rig's configuration.
        user: who makes the request; "" for the operator of this machine.
        rollback: restore the previous model instead.
        say: called with remarks for the user.

    Raises:
        ModelError: the monitor's model does not support an effect, or the residual does not fall.
        ConfigError: the rig's configuration or model cannot be read.
        KeysError: the rig has keys, and `user` is not the operator of this machine.
    """
    path, user = model_path(rig), operator_name(load_rig(rig).bus, user)
    name, found = study.folder.resolve().name, None
    if rollback:
        request = ModelRequest("rollback", "", user, f"rolled back from study {name}")
    else:
        found = promotion(study, load_model(path))
        effects = ", ".join(a.effect for a in study.file.effects)
        request = ModelRequest("promote", found.text, user, f"study {name}: {effects}")
    reply, live = _send(rig, path, request, say)
    if reply.done:
        ledger.append(study, request.action, rig=str(rig), live=live, text=reply.text)
    return ModelHandover(reply, live, found)


def restore(rig: Path) -> ModelHandover:
    """Restore the previous model of a rig's monitor, whatever the present one is from.

    Raises:
        ConfigError: the rig's configuration cannot be read, or there is no previous model.
    """
    user = operator_name(load_rig(rig).bus, "")
    request = ModelRequest("rollback", "", user, "rolled back from the rig's page")
    reply, live = _send(rig, model_path(rig), request, lambda _: None)
    return ModelHandover(reply, live, None)


def model_path(rig: Path) -> Path:
    """Path of the model file that a rig's monitor uses."""
    return Path(monitor_section(load_rig(rig), rig).model)


def rehearse(new: RigModel, old: RigModel, blocks: Sequence[SampleBlock]) -> Rehearsal:
    """Run both models over the same samples; the settling time of the filters is skipped."""
    seconds = (blocks[-1].t_ns[-1] - blocks[0].t_ns[0]) / 1e9 if blocks else 0.0
    (before, _), (after, alarms) = (_run(model, blocks) for model in (old, new))
    return Rehearsal(float(seconds), before, after, alarms)


def _run(model: RigModel, blocks: Sequence[SampleBlock]) -> tuple[float, tuple[str, ...]]:
    monitor, residuals, names = RigMonitor(model), [], dict[str, None]()
    for block in blocks:
        watched = monitor.update(block)
        if watched is not None:
            residuals.append(watched.estimates.column("residual").values)
            raised = (a for a in watched.announcements if isinstance(a, Alarm))
            names |= dict.fromkeys(a.name for a in raised if a.state == "unacknowledged")
    whole = np.concatenate(residuals)[model.decision.settle :] if residuals else np.zeros(0)
    return float(np.sqrt(np.nanmean(whole**2))) if whole.size else float("nan"), tuple(names)


def _send(
    rig: Path, path: Path, request: ModelRequest, say: Callable[[str], None]
) -> tuple[ModelReply, bool]:
    """The monitor's answer and True; if none runs, the file is changed, and False."""
    config = load_rig(rig)
    try:
        bus = connect(config, unique_process("promote"), LINK_TIMEOUT)
        try:
            return ask_for_model(bus, request), True
        finally:
            bus.close()
    except BusError as error:
        say(f"{error}; the model file is changed for the monitor's next start")
        return _in_file(config, path, request), False


def _in_file(config: RigConfig, path: Path, request: ModelRequest) -> ModelReply:
    identity = proved_here(config.bus, config.rig.id, request)
    now, author = time.time_ns(), model_versions.Author(request.user, request.text, identity)
    if request.action == "rollback":
        model_versions.roll_back(path, now, author)
    else:
        model_versions.install(path, request.model, now, author)
    return ModelReply(True, "in force from the monitor's next start on")

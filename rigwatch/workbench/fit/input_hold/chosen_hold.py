"""The study with a hold for every input, chosen from its recordings.

A healthy recording is used if available, as a fault cannot be mistaken for a hold there.

An input that seems late may hide what is slow in the machine. Whether a later hold than need be was
chosen can be asked, and the hold be chosen anew with an effect in the model.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from rigwatch.physics.engine.equations import Placement
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, parameters_of, quiet_scale
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.fit.fitted_model import placements_of
from rigwatch.workbench.fit.input_hold.best_hold import best_hold
from rigwatch.workbench.fit.input_hold.hold_trials import HoldTrials, Tried, with_holds
from rigwatch.workbench.fit.input_hold.seen_held import seen_held
from rigwatch.workbench.study import HEALTHY, RECORDINGS, Held, Study


def with_hold(study: Study, data: Data, scale: FloatArray | None = None) -> Study:
    """The study with a model that has a hold for every input.

    Args:
        study: as opened.
        data: its recordings.
        scale: divisor of each output's residuals, shape (outputs,).

    Raises:
        ModelError: the model cannot be fitted with any hold.
    """
    model = study.model
    names = model.unheld()
    if not names:
        return study
    if not model.states:
        return replace(study, model=with_holds(model, dict.fromkeys(names, ("linear", 0.0))))
    source_data = data.of_healthy or data
    placements = () if data.healthy is not None else placements_of(study, data.train)
    # The healthy recording is modelled without the accepted effects.
    start = parameters_of(study.file) if placements else dict(study.file.start)
    trials = HoldTrials(study, source_data, placements, scale)
    line = trials.fitted("linear", 0.0, start, None)
    noise = quiet_scale(source_data.train) if scale is None else scale
    best = best_hold(trials, line, noise)
    source = HEALTHY if data.healthy is not None else RECORDINGS
    return _held_as_chosen(study, source_data, line, best, source)


def may_hide_slow(study: Study, data: Data) -> bool:
    """Whether inputs act later than they could, as far as the recordings alone have shown."""
    names = _from_recordings(study)
    if not names:
        return False
    chosen, free = study.holds[names[0]], _with_holds_open(study, names)
    return chosen.late > 0.0 or (chosen.hold == "zero" and not seen_held(free, data))


def with_hold_beside(
    study: Study, data: Data, base: Fitted, beside: Sequence[Placement]
) -> tuple[str, Study, Fitted]:
    """The study with the hold that its recordings show with the best of some effects in the model.

    Args:
        study: its hold is chosen from its recordings.
        data: its recordings.
        base: its model fitted with that hold.
        beside: the effects, one of which is added.

    Returns:
        The effect as "effect@port", the study, and its model fitted with the effect.

    Raises:
        ModelError: the model cannot be fitted with any of them.
    """
    free = _with_holds_open(study, _from_recordings(study))
    start = base.train.values()
    lines = list[tuple[HoldTrials, Tried]]()
    for placement in beside:
        trials = HoldTrials(free, data, (*base.placements, placement), base.train.scale)
        with suppress(ModelError):
            lines.append((trials, trials.fitted("linear", 0.0, start, base)))
    if not lines:
        raise ModelError("the model cannot be fitted with any of these effects")
    trials, line = min(lines, key=lambda pair: pair[1].size)
    best = best_hold(trials, line, quiet_scale(data.train))
    placement = trials.placements[-1]
    label = placement.label
    return label, _held_as_chosen(free, data, line, best), best.fitted


def _from_recordings(study: Study) -> list[str]:
    """Inputs whose hold was chosen by fits to the recordings."""
    return [n for n, held in study.holds.items() if held.source == RECORDINGS and not held.ends]


def _with_holds_open(study: Study, names: Sequence[str]) -> Study:
    """The study without the holds of some inputs."""
    known = {name: held for name, held in study.holds.items() if name not in names}
    model = with_holds(study.model, dict.fromkeys(names, (None, 0.0)))
    return replace(study, model=model, holds=known)


def _held_as_chosen(
    study: Study, data: Data, line: Tried, best: Tried, source: str = RECORDINGS
) -> Study:
    """The study with the best hold for each input without one."""
    ratio = (best.held_out_size / line.held_out_size) ** 0.5
    held = Held(best.hold, best.late, data.train.dt * best.late, source, ratio)
    return held_as(study, {**study.holds, **dict.fromkeys(study.model.unheld(), held)})


def held_as(study: Study, holds: Mapping[str, Held]) -> Study:
    """The study with the holds found for another instance of it."""
    new = {n: (held.hold, held.acting) for n, held in holds.items() if n in study.model.inputs}
    return replace(study, model=with_holds(study.model, new), holds=dict(holds))

"""Chooses the hold of inputs between samples from the data if neither model nor study gives it.

A D/A converter holds its value until the next update (zero-order hold); a measured signal varies
linearly between samples. Confusing the two shifts the input by half a sample, which looks like a
slow sensor. The model is fitted with both, and with zero-order holds delayed by a fraction of a
sample, as when the converter is written after the sensors are read. A hold other than linear
requires an error that falls, over blocks, by more than chance, on held-out recordings if there are
any, and in training: recordings that contradict each other show another defect of the model.

A healthy recording is used if available, as a fault cannot be mistaken for a hold there.

Inputs that are seen to be held, as their steps start and end at rest, are not taken as lines,
however far off the model is: a line through a step begins half a sample before the step.

An input that seems late may hide what is slow in the machine. Whether a later hold than need be was
chosen can be asked, and the hold be chosen anew with an effect in the model.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from msgspec import structs
from scipy.optimize import minimize_scalar

from rigwatch.physics.engine.equations import Hold, Model, Placement
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, parameters_of, quiet_scale
from rigwatch.workbench.fit.fitted import Fitted, block_differences, block_errors
from rigwatch.workbench.fit.fitted_model import fit_model, placements_of
from rigwatch.workbench.study import HEALTHY, RECORDINGS, Held, Study

BEYOND_CHANCE = 3.0
"""Standard deviations by which the error must fall."""
MATERIAL = 0.01
"""Relative fall of the squared error that is required."""
AT_NOISE = 1.03
"""Ratio of error to sensor noise below which no delay is searched for."""
DELAYS = (0.25, 0.5, 0.75, 1.0)
"""Delays tried before the best is refined, as shares of a sample."""
FINE = 5e-4
"""Resolution of the delay, as a share of a sample."""
STEP = 0.05
"""Least change of an input that counts as a step, over its range."""
STEPPED = 0.9
"""Share of the squared changes of an input in steps from rest to rest, from which it is held."""


@dataclass(frozen=True, eq=False)
class _Tried:
    """One hold and the model fitted with it."""

    hold: Hold
    late: float
    fitted: Fitted


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
    try_one = partial(_tried, study, source_data, placements, scale)
    line = try_one("linear", 0.0, start, None)
    noise = quiet_scale(source_data.train) if scale is None else scale
    best = _chosen(study, source_data, try_one, line, noise)
    source = HEALTHY if data.healthy is not None else RECORDINGS
    return _held_as_chosen(study, source_data, line, best, source)


def may_hide_slow(study: Study, data: Data) -> bool:
    """Whether inputs act later than they could, as far as the recordings alone have shown."""
    names = _from_recordings(study)
    if not names:
        return False
    chosen, free = study.holds[names[0]], _with_holds_open(study, names)
    return chosen.late > 0.0 or (chosen.hold == "zero" and not _seen_held(free, data))


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
    lines = list[tuple[Placement, _Tried]]()
    for placement in beside:
        with suppress(ModelError):
            line = _tried(
                free, data, (*base.placements, placement), base.train.scale,
                "linear", 0.0, start, base,
            )  # fmt: skip
            lines.append((placement, line))
    if not lines:
        raise ModelError("the model cannot be fitted with something slow at any port")
    placement, line = min(lines, key=lambda pair: _size(pair[1]))
    try_one = partial(_tried, free, data, (*base.placements, placement), base.train.scale)
    best = _chosen(free, data, try_one, line, quiet_scale(data.train))
    label = f"{placement.name}@{placement.port}"
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
    study: Study, data: Data, line: _Tried, best: _Tried, source: str = RECORDINGS
) -> Study:
    """The study with the best hold for each input without one."""
    before, after = (float(np.nanmean(_blocks(each.fitted))) for each in (line, best))
    ratio = (after / before) ** 0.5
    held = Held(best.hold, best.late, data.train.dt * best.late, source, ratio)
    return held_as(study, {**study.holds, **dict.fromkeys(study.model.unheld(), held)})


def with_holds(model: Model, holds: Mapping[str, tuple[Hold | None, float]]) -> Model:
    """The model with the holds of some inputs set."""
    inputs = {
        name: structs.replace(own, hold=holds[name][0], late=holds[name][1])
        if name in holds
        else own
        for name, own in model.inputs.items()
    }
    return structs.replace(model, inputs=inputs)


def held_as(study: Study, holds: Mapping[str, Held]) -> Study:
    """The study with the holds found for another instance of it."""
    new = {n: (held.hold, held.acting) for n, held in holds.items() if n in study.model.inputs}
    return replace(study, model=with_holds(study.model, new), holds=dict(holds))


def _chosen(
    study: Study, data: Data, try_one: "partial[_Tried]", line: _Tried, noise: FloatArray
) -> _Tried:
    """The best hold; a line is tried."""
    kept = try_one("zero", 0.0, line.fitted.train.values(), line.fitted)
    seen = _seen_held(study, data)
    best = kept if seen or explains_more(kept.fitted, line.fitted) else line
    if data.along_motion or _at_noise(best, noise):
        return best
    late = _refined(partial(try_one, "zero"), kept)
    return late if late is not None and explains_more(late.fitted, best.fitted) else best


def _seen_held(study: Study, data: Data) -> bool:
    """Whether all inputs without a hold that change are seen to be held."""
    unheld, train = set(study.model.unheld()), data.train
    own = [at for at, name in enumerate(study.model.inputs) if name in unheld]
    changing = [at for at in own if np.ptp(train.inputs[:, at]) > 0]
    return bool(changing) and all(
        any(stepped(train.inputs[part, at]) for part in train.slices) for at in changing
    )


def stepped(signal: FloatArray) -> bool:
    """Whether a signal changes in steps from rest to rest, so that it is held between samples.

    Args:
        signal: of one recording, shape (samples,).
    """
    change = np.diff(signal)
    moves = np.concatenate([[False], change != 0.0, [False]])
    alone = moves[1:-1] & ~moves[:-2] & ~moves[2:] & (np.abs(change) > STEP * np.ptp(signal))
    total = float(np.sum(np.square(change)))
    return total > 0.0 and float(np.sum(np.square(change[alone]))) >= STEPPED * total


def _tried(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    placements: tuple[Placement, ...],
    scale: FloatArray | None,
    hold: Hold,
    late: float,
    start: Mapping[str, float],
    base: Fitted | None,
) -> _Tried:
    model = with_holds(study.model, dict.fromkeys(study.model.unheld(), (hold, late)))
    fitted = fit_model(
        replace(study, model=model), data, placements, start, scale,
        base=base, multi_start=base is None,
    )  # fmt: skip
    return _Tried(hold, late, fitted)


def _refined(try_late: "partial[_Tried]", kept: _Tried) -> _Tried | None:
    """The best delay; None if no fit succeeds."""
    start, found = kept.fitted.train.values(), dict[float, _Tried]()

    def size(late: float) -> float:
        late = float(late)
        try:
            found[late] = try_late(late, start, kept.fitted)
        except ModelError:
            return float("inf")
        return _size(found[late])

    sizes = [size(late) for late in DELAYS]
    if not found:
        return None
    # If no coarse step improves the error, no fine one does.
    if min(sizes) < _size(kept):
        near = DELAYS[int(np.argmin(sizes))]
        ends = (max(near - 0.25, 1e-3), min(near + 0.25, 1.0))
        minimize_scalar(size, bounds=ends, method="bounded", options={"xatol": FINE})
    return min(found.values(), key=_size)


def _size(tried: _Tried) -> float:
    return _training_size(tried.fitted)


def _training_size(fitted: Fitted) -> float:
    """Mean squared error over the blocks of the training."""
    return float(np.nanmean(block_errors(fitted.train)))


def explains_more(one: Fitted, other: Fitted) -> bool:
    """Whether the error falls by more than chance from the other to the one, in training too.

    Args:
        one, other: fits to the same recordings, over windows of the same length.
    """
    if _training_size(one) > _training_size(other):
        return False
    before = _blocks(other)
    fall = block_differences(other.held_out, one.held_out)
    spread = float(np.std(fall, ddof=1) / np.sqrt(len(fall))) if len(fall) > 1 else 0.0
    mean = float(np.mean(fall))
    return mean > BEYOND_CHANCE * spread and mean > MATERIAL * float(np.nanmean(before))


def _blocks(fitted: Fitted) -> FloatArray:
    return block_errors(fitted.held_out)


def _at_noise(tried: _Tried, noise: FloatArray) -> bool:
    return float(np.sqrt(np.mean((tried.fitted.train.rms / noise) ** 2))) < AT_NOISE

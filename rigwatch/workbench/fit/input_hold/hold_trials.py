"""A model fitted with each hold, and which hold explains the recordings.

The model is fitted with lines and with zero-order holds, also delayed by a fraction of a sample, as
when the converter is written after the sensors are read. A hold other than linear requires an error
that falls, over blocks, by more than chance, on held-out recordings if there are any, and in
training: recordings that contradict each other show another defect of the model.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from msgspec import structs
from scipy.optimize import minimize_scalar

from rigwatch.physics.engine.equations import Hold, Model, Placement
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit.fitted import Fitted, block_differences, block_errors
from rigwatch.workbench.fit.fitted_model import fit_model
from rigwatch.workbench.fit.input_hold.seen_held import seen_held
from rigwatch.workbench.study import Study

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


@dataclass(frozen=True, eq=False)
class Tried:
    """One hold and the model fitted with it."""

    hold: Hold
    late: float
    fitted: Fitted

    @property
    def size(self) -> float:
        """Mean squared error over the blocks of the training."""
        return _training_size(self.fitted)

    @property
    def held_out_size(self) -> float:
        """The same of the recordings held out."""
        return float(np.nanmean(_blocks(self.fitted)))


def with_holds(model: Model, holds: Mapping[str, tuple[Hold | None, float]]) -> Model:
    """The model with the holds of some inputs set."""
    inputs = {
        name: structs.replace(own, hold=holds[name][0], late=holds[name][1])
        if name in holds
        else own
        for name, own in model.inputs.items()
    }
    return structs.replace(model, inputs=inputs)


def tried(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    placements: tuple[Placement, ...],
    scale: FloatArray | None,
    hold: Hold,
    late: float,
    start: Mapping[str, float],
    base: Fitted | None,
) -> Tried:
    """The model fitted with a hold, and with some effects.

    Args:
        study, data: with inputs that have no hold yet.
        placements: the effects.
        scale: divisor of each output's residuals, shape (outputs,).
        hold, late: the hold, and its delay as a share of a sample.
        start: initial values.
        base: a fit to start from; None for a search from several starts.

    Raises:
        ModelError: it cannot be fitted.
    """
    model = with_holds(study.model, dict.fromkeys(study.model.unheld(), (hold, late)))
    fitted = fit_model(
        replace(study, model=model), data, placements, start, scale,
        base=base, multi_start=base is None,
    )  # fmt: skip
    return Tried(hold, late, fitted)


def best_hold(
    study: Study, data: Data, try_one: "partial[Tried]", line: Tried, noise: FloatArray
) -> Tried:
    """The best hold; a line is tried."""
    kept = try_one("zero", 0.0, line.fitted.train.values(), line.fitted)
    seen = seen_held(study, data)
    best = kept if seen or explains_more(kept.fitted, line.fitted) else line
    if data.along_motion or _at_noise(best, noise):
        return best
    late = _refined(partial(try_one, "zero"), kept)
    return late if late is not None and explains_more(late.fitted, best.fitted) else best


def _refined(try_late: "partial[Tried]", kept: Tried) -> Tried | None:
    """The best delay; None if no fit succeeds."""
    start, found = kept.fitted.train.values(), dict[float, Tried]()

    def size(late: float) -> float:
        late = float(late)
        try:
            found[late] = try_late(late, start, kept.fitted)
        except ModelError:
            return float("inf")
        return found[late].size

    sizes = [size(late) for late in DELAYS]
    if not found:
        return None
    # If no coarse step improves the error, no fine one does.
    if min(sizes) < kept.size:
        near = DELAYS[int(np.argmin(sizes))]
        ends = (max(near - 0.25, 1e-3), min(near + 0.25, 1.0))
        minimize_scalar(size, bounds=ends, method="bounded", options={"xatol": FINE})
    return min(found.values(), key=lambda one: one.size)


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


def _at_noise(tried: Tried, noise: FloatArray) -> bool:
    return float(np.sqrt(np.mean((tried.fitted.train.rms / noise) ** 2))) < AT_NOISE

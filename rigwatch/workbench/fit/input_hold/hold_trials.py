"""A model fitted with each hold, and which hold explains the recordings.

The model is fitted with lines and with zero-order holds, also delayed by a fraction of a sample, as
when the converter is written after the sensors are read. A hold other than linear requires an error
that falls, over blocks, by more than chance, on held-out recordings if there are any, and in
training: recordings that contradict each other show another defect of the model.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.equations import Hold, Model, Placement
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit.fitted import Fitted, block_differences, block_errors
from rigwatch.workbench.fit.fitted_model import fit_model, trained
from rigwatch.workbench.fit.training import TrainingPart
from rigwatch.workbench.study import Study

BEYOND_CHANCE = 3.0
"""Standard deviations by which the error must fall."""
MATERIAL = 0.01
"""Relative fall of the squared error that is required."""


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


@dataclass(frozen=True, eq=False)
class HoldTrials:
    """Fits of a model with some effects that differ in the hold of its inputs.

    Attributes:
        study, data: with inputs that have no hold yet.
        placements: the effects.
        scale: divisor of each output's residuals, shape (outputs,).
    """

    study: Study
    data: Data
    placements: tuple[Placement, ...]
    scale: FloatArray | None

    def fitted(
        self, hold: Hold, late: float, start: Mapping[str, float], base: Fitted | None
    ) -> Tried:
        """The model fitted with a hold.

        Args:
            hold, late: the hold, and its delay as a share of a sample.
            start: initial values.
            base: a fit to start from; None for a search from several starts.

        Raises:
            ModelError: it cannot be fitted.
        """
        fitted = fit_model(
            self._held(hold, late), self.data, self.placements, start, self.scale,
            base=base, multi_start=base is None,
        )  # fmt: skip
        return Tried(hold, late, fitted)

    def on_part(
        self, part: TrainingPart, hold: Hold, late: float, start: Mapping[str, float], base: Fitted
    ) -> Tried:
        """The same on a part of the training, not judged by other recordings.

        Args:
            part: the part.
            hold, late, start: as in `fitted`.
            base: a fit to the part to start from.

        Raises:
            ModelError: it cannot be fitted.
        """
        held = self._held(hold, late)
        return Tried(hold, late, trained(held, part.data, self.placements, start, base))

    def _held(self, hold: Hold, late: float) -> Study:
        model = self.study.model
        return replace(
            self.study, model=with_holds(model, dict.fromkeys(model.unheld(), (hold, late)))
        )


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

"""The result of a fit: training and held-out errors, over all channels and by block."""

from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem
from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.fit import Fit
from rigwatch.physics.engine.search import Convergence
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.workbench.study import NOISES, told, told_unit

DIVERGED = 1e6
"""Ratio of an error to that without the effect beyond which the simulation has diverged."""
BLOCKS = 40
"""Number of blocks for statistics on a recording of a model without states."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fitted model with its held-out error.

    Attributes:
        placements: its effects.
        train, held_out: the fit, and the same parameters on the held-out recordings.
        substeps: integration steps per sample for non-stiff systems.
        horizon: samples from one re-initialisation to the next.
        calm: held-out samples away from discontinuities of an effect, shape (windows, length); None
            if there are none.
        convergence: how the fit ended; None if it started from another fit and was not checked.
    """

    placements: tuple[Placement, ...]
    train: Fit
    held_out: Fit
    substeps: int
    horizon: int
    calm: BoolArray | None = None
    convergence: Convergence | None = None

    @property
    def compiled(self) -> CompiledSystem:
        """The compiled system."""
        return self.train.compiled

    @property
    def determines_nothing(self) -> bool:
        """Whether the training leaves every parameter open, and so follows what is missing."""
        free, ended = set(self.compiled.system.free), self.convergence
        return bool(free) and ended is not None and free <= set(ended.undetermined)

    @property
    def train_error(self) -> float:
        """Overall error on the training recordings."""
        return overall_error(self.train)

    @property
    def held_out_error(self) -> float:
        """Overall error on the recordings held out."""
        return overall_error(self.held_out)

    @property
    def error_unit(self) -> str:
        """Unit of the overall errors: that of the channel if there is only one."""
        outputs = list(self.compiled.system.model.outputs.values())
        return outputs[0].unit if len(outputs) == 1 else NOISES

    @property
    def told_in(self) -> str:
        """Unit in which texts tell the overall errors."""
        outputs = list(self.compiled.system.model.outputs.values())
        return told_unit(outputs[0]) if len(outputs) == 1 else NOISES

    @property
    def told_error(self) -> float:
        """The held-out error in the unit in which it is told."""
        return told(self.held_out_error, self.told_in)


def overall_error(fitted: Fit) -> float:
    """Error over all channels: in the channel's unit if there is only one, else over its noise."""
    if len(fitted.scale) == 1:
        return float(fitted.rms[0])
    return float(np.sqrt(np.mean((fitted.rms / fitted.scale) ** 2)))


def error_text(value: float | None, before: float) -> str:
    """An error with four significant digits; "diverges" if it is far beyond the one before.

    Args:
        value: the error with an effect, None if it was not fitted.
        before: the error without it, in the same unit.
    """
    if value is None:
        return "-"
    return "diverges" if value > DIVERGED * before else f"{value:.4g}"


def block_errors(fitted: Fit) -> FloatArray:
    """Mean squared error of each block (a window or part of one); NaN without valid samples."""
    scale = fitted.scale if len(fitted.scale) > 1 else 1.0
    squared = (fitted.residuals / scale) ** 2
    means = [np.nanmean(p) if np.isfinite(p).any() else np.nan for p in blocks(squared)]
    return np.array(means)


def block_differences(one: Fit, other: Fit) -> FloatArray:
    """Mean squared error of `one` minus that of `other`, for blocks valid in both."""
    found = block_errors(one) - block_errors(other)
    return np.asarray(found[np.isfinite(found)])


def blocks(windowed: FloatArray) -> list[FloatArray]:
    """Windows (windows, samples, …) as blocks; few long windows are divided."""
    pieces = max(1, -(-BLOCKS // len(windowed)))
    cut = [np.array_split(window, min(pieces, len(window))) for window in windowed]
    return [piece for window in cut for piece in window]

"""Bases along the measured motion, each fitted briefly, side by side."""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.compile import compile_system, on_all_cores
from rigwatch.physics.engine.equations import Model, compose
from rigwatch.physics.engine.fit import Fit, Recording
from rigwatch.physics.engine.search import Convergence, WholeRuns, multi_start_fit
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.fit import with_kept_free


@dataclass(frozen=True, eq=False)
class Brief:
    """A base after a brief fit, and its error over the channels' scales."""

    fit: Fit
    ended: Convergence
    error: float

    @property
    def values(self) -> dict[str, float]:
        """Values of its parameters, by name."""
        return self.fit.values()


@dataclass(frozen=True, eq=False)
class Posed:
    """A brief search for a base's parameters."""

    search: WholeRuns
    scale: FloatArray

    def fitted(self) -> Brief:
        """The base as the search leaves it."""
        found, ended = multi_start_fit(self.search)
        error = float(np.sqrt(np.mean((found.rms / self.scale) ** 2)))
        return Brief(found, ended, error)


def posed(
    model: Model,
    recording: Recording,
    scale: FloatArray,
    start: Mapping[str, float],
    substeps: int,
) -> Posed | None:
    """A brief search from these values; None if the model cannot be simulated.

    Args:
        model: along its measured motion; its kept parameters are fitted.
        recording: what it is fitted to.
        scale: divisor of each output's residuals, shape (outputs,).
        start: initial values by name; the model's own for those not given.
        substeps: integration steps per sample.
    """
    try:
        compiled = compile_system(compose(with_kept_free(model), ()))
        begin = compiled.vector(start)
        search = WholeRuns(compiled, [recording], scale, start=begin, substeps=substeps, brief=True)
    except RigwatchError:
        return None
    return Posed(search, scale)


def all_fitted(searches: Sequence[Posed | None]) -> list[Brief | None]:
    """The result of each search, side by side; None where it fails."""
    found: list[Brief | None] = [None] * len(searches)

    def fit_one(index: int) -> None:
        one = searches[index]
        with contextlib.suppress(RigwatchError):
            found[index] = one.fitted() if one else None

    on_all_cores(fit_one, range(len(searches)))
    return found

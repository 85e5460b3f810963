"""Convergence of a fit, as a basis for verdicts.

The gradient is measured by the relative reduction of the squared error that a Gauss-Newton step
predicts (J. Dennis, R. Schnabel, Numerical Methods for Unconstrained Optimization, 1983, 7.2),

    promise = |P·r|² / |r|²,   P: projection on the slopes of the parameters not at a bound

which is independent of units and of the size of the error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.physics.engine.fit import Fit, bounds
from rigwatch.wire.arrays import FloatArray

PROMISED = 0.02
"""Largest predicted relative reduction of the squared error at which a fit has converged."""
AGREE = 1.02
"""Largest ratio of errors at which two fits count as the same optimum."""
UNDETERMINED = 1e-6
"""Singular value, relative to the largest, below which the data do not determine a direction."""
HEAVY = 0.3
"""Share of an undetermined direction above which a parameter belongs to it."""
TOUCHING = 1e-6
"""Distance from a bound, relative to the parameter's size, at which it counts as on the bound."""


@dataclass(frozen=True)
class Convergence:
    """Convergence of a fit.

    Attributes:
        converged: whether verdicts may rely on it.
        gradient: predicted relative reduction of the squared error by a further step.
        starts: number of fits from different starts.
        agreeing: number of fits that reached the same optimum as the best, including itself.
        undetermined: free parameters that the data do not determine.
        at_bound: free parameters on a bound.
        begun: start of the best fit, in words.
        reason: why it counts as converged or not, in words.
    """

    converged: bool
    gradient: float
    starts: int
    agreeing: int
    undetermined: tuple[str, ...]
    at_bound: tuple[str, ...]
    begun: str
    reason: str


def convergence(
    best: Fit,
    others: Sequence[Fit],
    begun: str,
    *,
    near_noise: bool,
    gradient: float | None = None,
    agreeing: int | None = None,
) -> Convergence:
    """Convergence of the best of several fits.

    Args:
        best: the best fit.
        others: fits of the same data from other starts.
        begun: start of the best fit, in words.
        near_noise: whether its error is so small that no other optimum could be much better.
        gradient: predicted relative reduction of the cost by a further step, if the cost is not
            the squared error alone.
        agreeing: number of fits that reached the optimum of the best; by `agrees` if None.
    """
    gradient = promise(best) if gradient is None else gradient
    if agreeing is None:
        agreeing = 1 + sum(agrees(other, best) for other in others)
    alone = bool(others) and agreeing == 1 and not near_noise
    steep = gradient > PROMISED
    reason = f"a further step would reduce the squared error by {gradient:.1%}" if steep else ""
    if alone:
        also = f"none of {len(others) + 1} starts leads where another does"
        reason = f"{reason}; {also}" if reason else also
    return Convergence(
        not (steep or alone),
        gradient,
        len(others) + 1,
        agreeing,
        undetermined(best),
        at_bound(best),
        begun,
        reason or _agreed(agreeing, len(others) + 1, near_noise=near_noise),
    )


def at_other_values(ended: Convergence, fitted: Fit) -> Convergence:
    """How a search ended, told of the parameters to which its ties were resolved."""
    return replace(ended, undetermined=undetermined(fitted), at_bound=at_bound(fitted))


def _agreed(agreeing: int, starts: int, *, near_noise: bool) -> str:
    if agreeing > 1:
        return f"{agreeing} of {starts} starts lead to the same optimum"
    if near_noise:
        return "the error is as small as the sensors' noise"
    return "the gradient vanishes; no other start was tried"


def spread(fitted: Fit) -> float:
    """Root mean square of the scaled residuals."""
    return float(np.sqrt(np.mean((fitted.rms / fitted.scale) ** 2)))


def agrees(other: Fit, best: Fit, errors: tuple[float, float] | None = None) -> bool:
    """Whether a fit reached the optimum of the best: the same error, or nearly the same parameters.

    `errors` are those of both by which they are compared, otherwise the spreads of their residuals.

    The error of a machine that sticks is rough: fits stop at different heights of one valley. By
    the slopes of the best, their parameters leave the same error.
    """
    there, least = errors or (spread(other), spread(best))
    if there <= AGREE * least:
        return True
    names = best.compiled.system.free
    step = np.array([other.values()[name] - best.values()[name] for name in names])
    residual = best.error.ravel()
    moved = np.linalg.norm(residual + _jacobian(best) @ step)
    return bool(moved <= AGREE * np.linalg.norm(residual))


def promise(fitted: Fit) -> float:
    """Predicted relative reduction of the squared error by a Gauss-Newton step within bounds."""
    residual = fitted.error.ravel()
    size = float(residual @ residual)
    columns, sizes = slopes(fitted)
    seen = sizes > 0
    if size == 0 or not np.any(seen):
        return 0.0
    left, values, _ = np.linalg.svd(columns[:, seen], full_matrices=False)
    basis = left[:, values > UNDETERMINED * values[0]]
    return float(np.sum((basis.T @ residual) ** 2) / size)


def slopes(fitted: Fit) -> tuple[FloatArray, FloatArray]:
    """Slopes of the residuals along the free parameters, normalised, and their lengths.

    Returns:
        columns of length 1, shape (residuals, free); their lengths, 0 for a parameter on a bound
        and for one that changes nothing.
    """
    held = set(at_bound(fitted))
    moving = [name not in held for name in fitted.compiled.system.free]
    columns = _jacobian(fitted) * moving
    sizes = np.sqrt(np.sum(columns**2, axis=0))
    return columns / np.where(sizes > 0, sizes, 1.0), sizes


def at_bound(fitted: Fit) -> tuple[str, ...]:
    """Free parameters on a bound."""
    low, high = bounds(fitted.compiled.system)
    values = fitted.values()
    found = []
    for name, lowest, highest in zip(fitted.compiled.system.free, low, high, strict=True):
        value = values[name]
        near = TOUCHING * max(abs(value), abs(fitted.compiled.system.parameters[name].value))
        if value - lowest <= near or highest - value <= near:
            found.append(name)
    return tuple(found)


def undetermined(fitted: Fit) -> tuple[str, ...]:
    """Parameters in directions along which the error hardly changes, relative to their sizes."""
    names, jacobian = fitted.compiled.system.free, _jacobian(fitted)
    if not names:
        return ()
    sizes = np.array([
        max(abs(fitted.values()[name]), abs(fitted.compiled.system.parameters[name].value), 1e-12)
        for name in names
    ])  # fmt: skip
    _, values, directions = np.linalg.svd(jacobian * sizes, full_matrices=False)
    flat = directions[values <= UNDETERMINED * max(float(values[0]), 1e-300)]
    return tuple(
        name for i, name in enumerate(names) if flat.size and np.max(np.abs(flat[:, i])) > HEAVY
    )


def _jacobian(fitted: Fit) -> FloatArray:
    return fitted.jacobian.reshape(fitted.error.size, fitted.jacobian.shape[-1])

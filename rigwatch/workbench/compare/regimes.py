"""How much a strength depends on the regime of motion from which it is estimated.

A law that differs from the machine's fits an average: a constant dry friction fitted to one that
falls with speed is too large at high speed and too small at low. Blocks of time agree on that
average, since every block contains all regimes. The recording is therefore divided into regimes of
equal size by each driving signal in turn, slow to fast, near to far. With d the derivative of the
residual r by one parameter and the others as fitted, regime b alone moves it by

    θ_b - θ = -Σ_b d·r / Σ_b d²,   w_b = Σ_b d² / Σ d²

and the variance between regimes is what chance does not explain,

    τ² = Σ_b w_b·[(θ_b - θ)² - (1 - w_b)·s_b²] / (1 - Σ_b w_b²)

with s_b² the sandwich variance of θ_b over blocks of time, the moment estimate of a random-effects
model (R. DerSimonian, N. Laird, Controlled Clinical Trials 7, 1986). The largest τ² of all signals
counts.

The machine's strength, for example the friction at full speed, is one of the regimes', not their
mean. Five that change evenly from -a to a have τ² = 5/8·a²; a truth anywhere between them has the
variance a²/3 (JCGM 100:2008 (GUM), 4.3.7).
"""

import numpy as np

from rigwatch.physics.engine.fit import Fit, Recording
from rigwatch.wire.arrays import FloatArray, IntArray

REGIMES = 5
"""Number of regimes by one signal."""
WITHIN = 8 / 15
"""Variance of a truth anywhere between the strengths of the regimes, over that between regimes."""


def variances_between_regimes(fitted: Fit, recording: Recording, block: IntArray) -> FloatArray:
    """Variance of each free parameter between regimes of motion, shape (m,); 0 if chance explains.

    Args:
        fitted: the fit, windows one after the other without gaps.
        recording: the recording it was fitted to; its inputs are the driving signals.
        block: number of the block of time of each row of the flattened error, shape (rows,).
    """
    count, outputs = fitted.error.size, recording.outputs.shape[1]
    slopes = fitted.jacobian.reshape(count, -1)
    if recording.thinning is not None or count > recording.outputs.size:
        return np.zeros(slopes.shape[1])
    error = fitted.error.reshape(count)
    sizes = np.abs(np.repeat(recording.inputs[: count // outputs], outputs, axis=0)).T
    largest = [max(between(d, error, size, block) for size in sizes) for d in slopes.T]
    return np.array(largest)


def between(direction: FloatArray, error: FloatArray, size: FloatArray, block: IntArray) -> float:
    """Variance between regimes of the size of one signal.

    Args:
        direction: derivative of the residual by the parameter, shape (n,).
        error: residual, shape (n,).
        size: of the signal, shape (n,).
        block: number of each sample's block of time, shape (n,).
    """
    used = direction != 0
    if np.count_nonzero(used) < REGIMES:
        return 0.0
    direction, error, block = direction[used], error[used], block[used]
    order = np.argsort(np.argsort(size[used], kind="stable"), kind="stable")
    regime = order * REGIMES // len(order)
    weight = np.bincount(regime, direction**2, REGIMES)
    if np.count_nonzero(weight > 0) < REGIMES:
        return 0.0
    moved = -np.bincount(regime, direction * error, REGIMES) / weight
    share = weight / weight.sum()
    left = error + direction * moved[regime]
    cell = regime * (int(block.max()) + 1) + block
    sums = np.bincount(cell, direction * left, REGIMES * (int(block.max()) + 1))
    chance = np.sum(sums.reshape(REGIMES, -1) ** 2, axis=1) / weight**2
    excess = float(np.sum(share * (moved**2 - (1 - share) * chance)))
    return max(excess, 0.0) / (1 - float(np.sum(share**2)))

"""Intervals of parameters that stay honest where residuals are not white.

A model that is wrong leaves residuals that hang together over many samples, and the textbook
covariance, which takes each for itself, promises too much. Here whole blocks vary instead ("block
sandwich": K.-Y. Liang, S. L. Zeger, Biometrika 73, 1986):

    cov θ = (JᵀJ)⁻¹ · (Σ_b gb·gbᵀ) · (JᵀJ)⁻¹ · B/(B − m),   gb = Jbᵀ·rb

with Student's t for B − m degrees of freedom, B blocks and m parameters.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from rigwatch.physics.engine.compiled import FloatArray
from rigwatch.physics.engine.fit import Fit
from rigwatch.workbench.fitted import blocks

CONFIDENCE = 0.95
TIED = 0.98
"""Correlation from which two parameters count as tied to each other."""


@dataclass(frozen=True)
class Value:
    """A parameter with its interval.

    Attributes:
        value: in `unit`.
        unit: its unit.
        interval: 95 %, None where the parameter was not fitted.
        note: what is wrong with it, in words; empty where nothing is.
    """

    value: float
    unit: str
    interval: tuple[float, float] | None
    note: str = ""


def covariance(fitted: Fit) -> tuple[FloatArray, int]:
    """Covariance of the free parameters, shape (m, m), and degrees of freedom."""
    m = fitted.jacobian.shape[-1]
    whole = fitted.jacobian.reshape(-1, m)
    bread = np.linalg.pinv(whole.T @ whole, rcond=1e-14)
    pairs = zip(blocks(fitted.jacobian), blocks(fitted.error), strict=True)
    pushes = np.array([j.T @ r for j, r in pairs])
    count = len(pushes)
    free = max(count - m, 1)
    meat = pushes.T @ pushes * (count / free)
    return np.asarray(bread @ meat @ bread), free


def values(fitted: Fit) -> dict[str, Value]:
    """Every parameter of the model with its interval."""
    system = fitted.compiled.system
    spread: dict[str, float] = {}
    if system.free:
        matrix, free = covariance(fitted)
        width = student.ppf(0.5 + CONFIDENCE / 2, free) * np.sqrt(np.diag(matrix))
        spread = dict(zip(system.free, width.tolist(), strict=True))
    notes = identifiability(fitted)
    found = {}
    for name, value in fitted.values().items():
        interval = (value - spread[name], value + spread[name]) if name in spread else None
        parameter = system.parameters[name]
        found[name] = Value(value, parameter.unit, interval, notes.get(name, ""))
    return found


def identifiability(fitted: Fit) -> dict[str, str]:
    """What this recording cannot tell, in words, by parameter."""
    names, m = fitted.compiled.system.free, fitted.jacobian.shape[-1]
    jacobian = fitted.jacobian.reshape(-1, m)
    sizes = np.linalg.norm(jacobian, axis=0)
    notes = {
        name: "has no influence on this recording"
        for name, size in zip(names, sizes, strict=True)
        if size < 1e-12 * max(sizes.max(initial=0.0), 1e-300)
    }
    unit = jacobian / np.where(sizes > 0, sizes, 1.0)
    together = np.linalg.pinv(unit.T @ unit, rcond=1e-14)
    root = np.sqrt(np.maximum(np.diag(together), 1e-300))
    correlation = together / np.outer(root, root)
    for i, name in enumerate(names):
        others = np.abs(np.delete(correlation[i], i))
        if name not in notes and others.size and others.max() > TIED:
            partner = [n for n in names if n != name][int(np.argmax(others))]
            notes[name] = f"tied to {partner} (correlation {others.max():.3f})"
    return notes

"""Records of the damaged Kabe antenna as the thesis made them: a fixed step, the recursion's own.

The method is Simulink's default for a fixed step (J. R. Dormand and P. J. Prince, 1980, fifth
order); see `rigwatch.structures.identification.integrators` for how that was found.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rigwatch.structures.identification.integrators import DORMAND_PRINCE
from rigwatch.structures.model.description import Structure
from rigwatch.structures.model.edit import with_values
from rigwatch.structures.model.matrices import mass_matrix, stiffness_matrix
from rigwatch.structures.records.record import Record
from rigwatch.wire.arrays import FloatArray
from tests.structures.published import Published

Rates = Callable[[float, FloatArray], FloatArray]


def thesis_record(structure: Structure, published: Published, duration: float = 10.0) -> Record:
    """Positions of all eight masses for one row of Tables 4.1 to 4.6."""
    rates, count = _antenna(structure, published), round(duration / published.h) + 1
    states = np.zeros((count, 16))
    for sample in range(count - 1):
        states[sample + 1] = _stepped(rates, sample * published.h, published.h, states[sample])
    return Record(published.h, {f"x{node}": states[:, node - 1] for node in range(1, 9)})


def _stepped(rates: Rates, time: float, h: float, state: FloatArray) -> FloatArray:
    method, slopes = DORMAND_PRINCE, np.zeros((6, 16))
    for stage, share in enumerate(method.c):
        at = state + h * (method.a[stage] @ slopes)
        slopes[stage] = rates(time + share * h, at)
    return np.asarray(state + h * (method.b @ slopes))


def _antenna(structure: Structure, published: Published) -> Rates:
    """Rates of positions and velocities with the row's true values, load and cubic spring."""
    k4, k1, cubic = published.true
    stiffness = stiffness_matrix(with_values(structure, {"k4_46": k4, "k1_6": k1}))
    inverse = 1.0 / np.diag(mass_matrix(structure))
    place = int(published.load["node"]) - 1

    def rates(time: float, state: FloatArray) -> FloatArray:
        pull = -(stiffness @ state[:8])
        pull[5] -= cubic * state[5] ** 3
        pull[place] += _push(published.load, time)
        return np.concatenate([state[8:], pull * inverse])

    return rates


def _push(load: dict[str, Any], time: float) -> float:
    waves = (s["amplitude"] * np.sin(s["omega"] * time) for s in load.get("sines", []))
    return float(load.get("step", 0.0) + sum(waves))

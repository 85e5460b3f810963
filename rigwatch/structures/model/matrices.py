"""Mass and stiffness matrices of a structure, its natural modes, and its unconstrained nodes.

Linear terms only: M diagonal [kg], K = Σ_s k_s·B_sᵀ·B_s [N/m], modes K·φ = ω²·M·φ.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from rigwatch.structures.model.description import Structure, coefficient
from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Modes:
    """Natural modes, slowest first.

    Attributes:
        omega: natural frequencies, shape (n,) [rad/s].
        shapes: mass-normalised, one column per mode, shape (n, n) [kg^-1/2].
    """

    omega: FloatArray
    shapes: FloatArray


def rows(structure: Structure) -> dict[str, FloatArray]:
    """B_s of each spring: +1 at its first node, −1 at its second; each of shape (n,)."""
    places = {node: index for index, node in enumerate(structure.nodes)}
    found = {}
    for name, spring in structure.springs.items():
        row = np.zeros(len(places))
        for sign, end in zip((1.0, -1.0), spring.between, strict=False):
            row[places[end]] = sign
        found[name] = row
    return found


def mass_matrix(structure: Structure) -> FloatArray:
    """M, shape (n, n) [kg]."""
    return np.diag([coefficient(node.mass).value for node in structure.nodes.values()])


def spring_matrix(structure: Structure, spring: str) -> FloatArray:
    """[K]_j: the stiffness matrix with every spring but one set to zero, shape (n, n) [N/m]."""
    row = rows(structure)[spring]
    return coefficient(structure.springs[spring].stiffness).value * np.outer(row, row)


def stiffness_matrix(structure: Structure) -> FloatArray:
    """K at rest, gaps open, shape (n, n) [N/m]."""
    total = np.zeros((len(structure.nodes), len(structure.nodes)))
    for name, spring in structure.springs.items():
        if spring.law != "gap":
            total += spring_matrix(structure, name)
    return total


def modes(structure: Structure) -> Modes:
    """Natural modes about rest."""
    squares, shapes = eigh(stiffness_matrix(structure), mass_matrix(structure))
    return Modes(np.sqrt(np.maximum(squares, 0.0)), shapes)


def afloat(structure: Structure) -> list[list[str]]:
    """Groups of nodes that springs connect to each other but not to ground."""
    groups = {node: {node} for node in structure.nodes}
    grounded: set[str] = set()
    for spring in structure.springs.values():
        if len(spring.between) == 1:
            grounded.add(spring.between[0])
            continue
        joined = groups[spring.between[0]] | groups[spring.between[1]]
        groups |= dict.fromkeys(joined, joined)
    loose = [node for node in structure.nodes if not groups[node] & grounded]
    seen: list[set[str]] = []
    for node in loose:
        if groups[node] not in seen:
            seen.append(groups[node])
    return [[node for node in structure.nodes if node in group] for group in seen]

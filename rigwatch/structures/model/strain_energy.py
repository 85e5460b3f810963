"""Observability of springs from modal strain energy (thesis Appendix A).

    U_ij = ½·φ̂iᵀ·[K]_j·φ̂i,   φ̂i mass-normalised, [K]_j with every spring but j set to zero    (A.1)

as a share of the mode's total. A spring that carries much energy in many modes shows in the
motion under any load; one that carries little is hard to identify.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.structures.model.description import Structure
from rigwatch.structures.model.matrices import modes, spring_matrix
from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class StrainEnergy:
    """Shares of strain energy.

    Attributes:
        springs: their names.
        omega: natural frequencies, shape (modes,) [rad/s].
        energies: U_ij, shape (modes, springs) [s^-2].
        shares: of the mode's total, shape (modes, springs).
    """

    springs: tuple[str, ...]
    omega: FloatArray
    energies: FloatArray
    shares: FloatArray

    def ranking(self, least: float = 0.2) -> list[str]:
        """Springs by the number of modes in which they carry more than `least`, then by energy."""
        count, total = (self.shares > least).sum(axis=0), self.shares.sum(axis=0)
        order = sorted(range(len(self.springs)), key=lambda j: (-count[j], -total[j]))
        return [self.springs[j] for j in order]

    def grouped(self, groups: dict[str, tuple[str, ...]]) -> "StrainEnergy":
        """A group of springs under one name, such as all those of stiffness k1."""
        places = {name: index for index, name in enumerate(self.springs)}
        columns = [[places[spring] for spring in members] for members in groups.values()]
        return StrainEnergy(
            tuple(groups),
            self.omega,
            np.stack([self.energies[:, c].sum(axis=1) for c in columns], axis=1),
            np.stack([self.shares[:, c].sum(axis=1) for c in columns], axis=1),
        )


def strain_energy(structure: Structure) -> StrainEnergy:
    """The share of each spring in each mode of the structure at rest."""
    found = modes(structure)
    energies = np.stack(
        [
            0.5
            * np.einsum("im,ij,jm->m", found.shapes, spring_matrix(structure, name), found.shapes)
            for name in structure.springs
        ],
        axis=1,
    )
    shares = energies / energies.sum(axis=1, keepdims=True)
    return StrainEnergy(tuple(structure.springs), found.omega, energies, shares)


def by_family(names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Springs grouped by their name before the underscore: k1_6 and k1_7 belong to k1."""
    families: dict[str, tuple[str, ...]] = {}
    for name in names:
        family = name.partition("_")[0]
        families[family] = (*families.get(family, ()), name)
    return dict(sorted(families.items()))

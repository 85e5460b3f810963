"""Structures as masses, springs and dampers: description, checks, matrices, modes, equations."""

from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.model.description import Structure, coefficients, label
from rigwatch.structures.model.edit import with_unknowns, with_values
from rigwatch.structures.model.strain_energy import StrainEnergy, by_family, strain_energy
from rigwatch.structures.model.structure_model import to_model

__all__ = [
    "StrainEnergy",
    "Structure",
    "by_family",
    "coefficients",
    "label",
    "load_structure",
    "strain_energy",
    "to_model",
    "with_unknowns",
    "with_values",
]

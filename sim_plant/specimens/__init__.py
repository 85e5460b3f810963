"""Small machines of other equations and integrators, each with an effect hidden in it.

A specimen goes with a model that ships: what it is driven with and what its sensors read are the
model's inputs and outputs, in their order. Its equations are written in energies, volumes and
charges, contacts as what touches and slips, and it is integrated by semi-implicit Euler steps.

    recorded = specimen("attached_mass").record(seed=3, hidden=True)
"""

from sim_plant.specimens.specimen import Recorded, Specimen
from sim_plant.specimens.table import HIDDEN, specimen

__all__ = ["HIDDEN", "Recorded", "Specimen", "specimen"]

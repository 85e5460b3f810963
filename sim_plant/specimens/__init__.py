"""Small machines with independent equations and integrators, each with one hidden effect.

A specimen belongs to a shipped model: its drives and sensor signals are the model's inputs and
outputs, in their order. Its equations are in energies, volumes and charges, its contacts stick and
slip, and it is integrated by semi-implicit Euler steps.

    recorded = specimen("attached_mass").record(seed=3, hidden=True)
"""

from sim_plant.specimens.specimen import Recorded, Specimen
from sim_plant.specimens.table import HIDDEN, specimen

__all__ = ["HIDDEN", "Recorded", "Specimen", "specimen"]

"""Machines of six kinds, each with effects that can be hidden in it, as plants to be explained.

Each has its own equations and integrator and shares nothing with the models that are fitted to it.
Inputs are held between samples, sensors have noise and finite resolution, and runs start at rest.

    motor = MACHINES["motor"]
    table = log(motor, {"coulomb": strength_for(motor, "coulomb", 0.1, seed=1)}, 0.002, seed=1)
"""

from sim_plant.machines.answers import RIGHT, Answer, judged
from sim_plant.machines.machine import MACHINES, Machine, log, strength_for

__all__ = ["MACHINES", "RIGHT", "Answer", "Machine", "judged", "log", "strength_for"]

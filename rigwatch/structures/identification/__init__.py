"""Identification of a structure's masses, springs and dampers, by five methods.

`identify` runs a method; quasilinearization is the thesis's (4.10)-(4.19), multiple shooting is
ours.
"""

from rigwatch.structures.identification.identified_model import modelled, seconds_of
from rigwatch.structures.identification.identify import (
    CONFIDENCE,
    METHODS,
    SETTLED,
    Identification,
    solved,
    solver,
)
from rigwatch.structures.identification.least_squares import solve
from rigwatch.structures.identification.problem import Problem, problem_of

__all__ = [
    "CONFIDENCE",
    "METHODS",
    "SETTLED",
    "Identification",
    "Problem",
    "modelled",
    "problem_of",
    "seconds_of",
    "solve",
    "solved",
    "solver",
]

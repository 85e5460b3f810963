"""The next experiment: an excitation that tells apart effects that a recording cannot.

shapes that a laboratory can generate ──▶ simulated motion with each effect ──▶ the most different
"""

from rigwatch.workbench.experiment.next_experiment import Experiment, excitation, propose

__all__ = ["Experiment", "excitation", "propose"]

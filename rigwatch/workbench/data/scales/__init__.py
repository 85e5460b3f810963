"""Sizes of the signals at ports, measured, derived from what is measured, or simulated."""

from rigwatch.workbench.data.scales.port_sizes import port_sizes
from rigwatch.workbench.data.scales.simulated_states import simulated_states

__all__ = ["port_sizes", "simulated_states"]

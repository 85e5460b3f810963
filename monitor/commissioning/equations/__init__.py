"""Commissioning of the observer scheme, whose model consists of equations."""

from monitor.commissioning.equations.equations_commission import EQUATIONS, commission_equations
from monitor.commissioning.equations.stated_parameters import stated_in_si, units_of_parameters

__all__ = ["EQUATIONS", "commission_equations", "stated_in_si", "units_of_parameters"]

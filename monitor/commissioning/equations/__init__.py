"""Commissioning of the observer scheme, whose model consists of equations."""

from monitor.commissioning.equations.equations_commission import EQUATIONS, commission_equations

__all__ = ["EQUATIONS", "commission_equations"]

"""Multi-start fits: initial values, stopping rule, and convergence of the best fit.

search (ShortHorizons, WholeRuns) ──attempts──▶ fit_from_afar ──▶ Fit, Convergence
"""

from rigwatch.physics.engine.search.convergence import Convergence, convergence
from rigwatch.physics.engine.search.fit_from_afar import fit_from_afar
from rigwatch.physics.engine.search.short_horizons import ShortHorizons
from rigwatch.physics.engine.search.whole_runs import WholeRuns

__all__ = ["Convergence", "ShortHorizons", "WholeRuns", "convergence", "fit_from_afar"]

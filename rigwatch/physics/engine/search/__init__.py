"""Fits from afar: where they begin, when there are enough of them, and how the best one ended.

search (ShortHorizons, WholeRuns) ──attempts──▶ fit_from_afar ──▶ Fit, Convergence
"""

from rigwatch.physics.engine.search.convergence import Convergence, convergence
from rigwatch.physics.engine.search.fit_from_afar import fit_from_afar
from rigwatch.physics.engine.search.short_horizons import ShortHorizons
from rigwatch.physics.engine.search.whole_runs import WholeRuns

__all__ = ["Convergence", "ShortHorizons", "WholeRuns", "convergence", "fit_from_afar"]

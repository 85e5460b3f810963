"""Multi-start fits: initial values, stopping rule, and convergence of the best fit.

search (ShortHorizons, WholeRuns) ──attempts──▶ multi_start_fit ──▶ Fit, Convergence
"""

from rigwatch.physics.engine.search.continued_fit import (
    begun_anew_nearby,
    fit_continued,
    fit_nearby,
)
from rigwatch.physics.engine.search.convergence import (
    Convergence,
    at_bound,
    at_other_values,
    convergence,
    undetermined,
)
from rigwatch.physics.engine.search.hidden_states import continued_spread, has_hidden_states
from rigwatch.physics.engine.search.multi_start_fit import multi_start_fit
from rigwatch.physics.engine.search.promised_step import kept_promise
from rigwatch.physics.engine.search.short_horizons import ShortHorizons
from rigwatch.physics.engine.search.whole_runs import STARTS, WholeRuns

__all__ = [
    "STARTS",
    "Convergence",
    "ShortHorizons",
    "WholeRuns",
    "at_bound",
    "at_other_values",
    "begun_anew_nearby",
    "continued_spread",
    "convergence",
    "fit_continued",
    "fit_nearby",
    "has_hidden_states",
    "kept_promise",
    "multi_start_fit",
    "undetermined",
]

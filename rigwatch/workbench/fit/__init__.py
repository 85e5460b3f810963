"""A study's model fitted to its recordings, with intervals, healthy parameters and a free run."""

from rigwatch.workbench.fit.fitted_model import (
    Fitted,
    block_errors,
    fit_again,
    fit_base,
    fit_model,
    fit_twice,
    may_be_better,
    nodes,
    placements_of,
)
from rigwatch.workbench.fit.free_run import free_run
from rigwatch.workbench.fit.healthy_parameters import commissioned, loosened
from rigwatch.workbench.fit.healthy_reference import referenced
from rigwatch.workbench.fit.input_hold import held_as, with_hold
from rigwatch.workbench.fit.intervals import Value, as_written, values
from rigwatch.workbench.fit.profile import profile

__all__ = [
    "Fitted",
    "Value",
    "as_written",
    "block_errors",
    "commissioned",
    "fit_again",
    "fit_base",
    "fit_model",
    "fit_twice",
    "free_run",
    "held_as",
    "loosened",
    "may_be_better",
    "nodes",
    "placements_of",
    "profile",
    "referenced",
    "values",
    "with_hold",
]

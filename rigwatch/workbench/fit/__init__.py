"""Fits a study's model to its recordings: intervals, healthy parameters, holds, free run."""

from rigwatch.workbench.fit.fitted_model import (
    Fitted,
    block_differences,
    eigenvalues,
    fit_again,
    fit_base,
    fit_model,
    fit_twice,
    may_be_better,
    nodes,
    placements_of,
)
from rigwatch.workbench.fit.free_run import free_run
from rigwatch.workbench.fit.healthy_parameters import commissioned, loosely_told, loosened
from rigwatch.workbench.fit.healthy_reference import referenced
from rigwatch.workbench.fit.healthy_remainder import learns_from_healthy, with_healthy_remainder
from rigwatch.workbench.fit.input_hold import held_as, with_hold
from rigwatch.workbench.fit.intervals import (
    Value,
    as_written,
    covariance,
    interval_with_held,
    shown,
    values,
)
from rigwatch.workbench.fit.profile import profile

__all__ = [
    "Fitted",
    "Value",
    "as_written",
    "block_differences",
    "commissioned",
    "covariance",
    "eigenvalues",
    "fit_again",
    "fit_base",
    "fit_model",
    "fit_twice",
    "free_run",
    "held_as",
    "interval_with_held",
    "learns_from_healthy",
    "loosely_told",
    "loosened",
    "may_be_better",
    "nodes",
    "placements_of",
    "profile",
    "referenced",
    "shown",
    "values",
    "with_healthy_remainder",
    "with_hold",
]

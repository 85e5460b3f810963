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
)
from rigwatch.workbench.fit.free_run import free_run
from rigwatch.workbench.fit.healthy_parameters import commissioned, loosened
from rigwatch.workbench.fit.healthy_reference import referenced
from rigwatch.workbench.fit.intervals import Value, covariance, values
from rigwatch.workbench.fit.profile import profile

__all__ = [
    "Fitted",
    "Value",
    "block_errors",
    "commissioned",
    "covariance",
    "fit_again",
    "fit_base",
    "fit_model",
    "fit_twice",
    "free_run",
    "loosened",
    "may_be_better",
    "nodes",
    "profile",
    "referenced",
    "values",
]

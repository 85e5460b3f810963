"""Fits a study's model to its recordings: intervals, healthy parameters, holds, free run."""

from rigwatch.workbench.fit.another_start import (
    begun_from_given,
    begun_from_larger,
    begun_over_short_horizons,
    given_values,
    only_noise_left,
)
from rigwatch.workbench.fit.fitted import Fitted, block_differences, error_text
from rigwatch.workbench.fit.fitted_model import (
    eigenvalues,
    fit_base,
    fit_model,
    fit_with_retry,
    given_eigenvalues,
    keeps_accepted,
    may_be_local_minimum,
    nodes,
    placements_of,
    refit_from_short_horizons,
    trained,
    values_with,
)
from rigwatch.workbench.fit.free_run import free_run
from rigwatch.workbench.fit.healthy_parameters import (
    poorly_determined,
    with_free,
    with_healthy_parameters,
    with_kept_free,
    with_values,
)
from rigwatch.workbench.fit.healthy_reference import with_healthy_reference
from rigwatch.workbench.fit.healthy_remainder import with_healthy_remainder
from rigwatch.workbench.fit.input_hold import (
    explains_more,
    held_as,
    may_hide_slow,
    with_hold,
    with_hold_beside,
)
from rigwatch.workbench.fit.intervals import (
    NO_INFLUENCE,
    Value,
    as_written,
    block_numbers,
    covariance,
    interval_with_held,
    shown,
    values,
)
from rigwatch.workbench.fit.profile import profile
from rigwatch.workbench.fit.training import (
    TrainingPart,
    continued_train_error,
    each_recording,
    part_of,
)

__all__ = [
    "NO_INFLUENCE",
    "Fitted",
    "TrainingPart",
    "Value",
    "as_written",
    "begun_from_given",
    "begun_from_larger",
    "begun_over_short_horizons",
    "block_differences",
    "block_numbers",
    "continued_train_error",
    "covariance",
    "each_recording",
    "eigenvalues",
    "error_text",
    "explains_more",
    "fit_base",
    "fit_model",
    "fit_with_retry",
    "free_run",
    "given_eigenvalues",
    "given_values",
    "held_as",
    "interval_with_held",
    "keeps_accepted",
    "may_be_local_minimum",
    "may_hide_slow",
    "nodes",
    "only_noise_left",
    "part_of",
    "placements_of",
    "poorly_determined",
    "profile",
    "refit_from_short_horizons",
    "shown",
    "trained",
    "values",
    "values_with",
    "with_free",
    "with_healthy_parameters",
    "with_healthy_reference",
    "with_healthy_remainder",
    "with_hold",
    "with_hold_beside",
    "with_kept_free",
    "with_values",
]

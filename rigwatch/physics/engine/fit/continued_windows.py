"""Windows of a held-out recording: hidden states are continued from the previous window.

If a window could fit its own hidden states, every state would act as a free constant per window.
Counted samples therefore determine only the states that channels measure, which are known at the
start of the window anyway. Hidden states come from samples that do not count in that window:

* states of the model continue from the end of the previous window's best fit;
* states of effects run through all windows, as a restart in each would be a free constant.

The first window of a recording determines its own hidden states and does not count. If a recording
is one window, its first part determines them and does not count. A short window may determine its
hidden states so poorly that the next one diverges from where it ends. They are then led through all
windows, each begun with the measured states as its channels have them.
"""

import numpy as np

from rigwatch.physics.engine.fit.problem import Problem, Started
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError

LEAD = 0.1
"""Share of a single-window recording used to determine its hidden states."""


def continued(problem: Problem, parameters: FloatArray) -> Started:
    """Windows at given parameters, with hidden states determined by samples that do not count.

    Raises:
        ModelError: the simulation diverged.
    """
    shown, windows = problem.initial, len(problem.starts) > len(problem.first_windows)
    try:
        found = problem.start_windows(parameters)
        if not len(problem.hidden):
            return found
        if not windows:
            return _from_first_samples(problem, parameters)
        return _from_windows_before(problem, parameters)
    except ModelError:
        if not (windows and len(problem.hidden)):
            raise
    return _counted(problem, parameters, _led(problem, parameters, shown), _first(problem))


def _first(problem: Problem) -> BoolArray:
    """Samples of the recordings' first windows, shape (windows, samples)."""
    found = np.zeros(problem.measured.shape[:2], np.bool_)
    found[problem.first_windows] = True
    return found


def _led(problem: Problem, parameters: FloatArray, shown: FloatArray) -> FloatArray:
    """Initial states with hidden ones led through the windows, shape (windows, states).

    Args:
        problem, parameters: as for `continued`.
        shown: initial states from the channels; the first window's hidden ones begin there.
    """
    problem.initial = shown.copy()
    for rows in problem.window_order:
        ended = problem.ends_before(parameters, rows)
        problem.begin_at(rows, problem.hidden, ended[:, problem.hidden])
    return problem.initial


def _from_windows_before(problem: Problem, parameters: FloatArray) -> Started:
    """Windows with hidden states continued from the best fit of the one before."""
    began = problem.initial.copy()
    hidden = _continued_from_previous(problem, parameters)
    if not np.isfinite(hidden).all():
        raise ModelError(
            f"{problem.system.model.name}: states that no channel shows diverged (NaN or infinite)"
            " from one window to the next"
        )
    began[:, problem.hidden] = hidden
    return _counted(problem, parameters, began, _first(problem))


def _continued_from_previous(problem: Problem, parameters: FloatArray) -> FloatArray:
    """Initial hidden states of each window, shape (windows, hidden)."""
    own = set(problem.hidden[problem.hidden < len(problem.system.model.states)].tolist())
    effect_states = np.array([column for column in problem.hidden if column not in own], np.int64)
    initial = problem.initial.copy()
    order = problem.window_order if len(effect_states) else [problem.later_windows]
    for rows in order:
        ended = problem.ends_before(parameters, rows)
        initial[rows] = ended
        # Effect states continue; the model's own states are re-initialised in the next window.
        problem.begin_at(rows, effect_states, ended[:, effect_states])
    return initial[:, problem.hidden]


def _from_first_samples(problem: Problem, parameters: FloatArray) -> Started:
    """Windows that are whole recordings, with hidden states from their own first samples."""
    leads = np.maximum(np.round(LEAD * np.array(problem.lengths)), 2)
    beginning = np.arange(problem.length) < leads[:, None]
    whole = problem.measured.copy()
    problem.measured[~beginning] = np.nan
    if not np.isfinite(problem.measured).any():
        problem.measured[:] = whole
        return problem.start_windows(parameters)
    problem.settle(parameters)
    problem.measured[:] = whole
    return _counted(problem, parameters, problem.initial, beginning)


def _counted(
    problem: Problem, parameters: FloatArray, began: FloatArray, determining: BoolArray
) -> Started:
    """Windows with these initial hidden states; the samples that determine them do not count."""
    problem.hold(began, problem.hidden)
    problem.measured[determining] = np.nan
    error, slopes = problem.settle(parameters)
    return Started(parameters, problem.initial, error, slopes)

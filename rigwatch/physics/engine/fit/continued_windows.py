"""Windows of a recording that judges: what no channel shows there goes on from the window before.

A window that may choose its own hidden states turns whatever has memory into a free constant of
each window. So samples that count tell only the states that channels show, which are measured at
the window's beginning anyway. The others come from samples that do not count in that window:

* states of the model are what the window before has led to, with its own best beginning;
* states of effects run on through all windows, as a new beginning each time would be a constant.

The first window of a recording tells its own hidden states and does not count. Where a recording is
one window, its beginning tells them, and does not count either.
"""

import numpy as np

from rigwatch.physics.engine.fit.problem import Problem, Started
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.errors import ModelError

LEAD = 0.1
"""Share of a recording that tells its hidden states, where the recording is one window."""


def continued(problem: Problem, parameters: FloatArray) -> Started:
    """Windows at given parameters, their hidden states told by samples that do not count.

    Raises:
        ModelError: the simulation diverged.
    """
    found = problem.start_windows(parameters)
    if not len(problem.hidden):
        return found
    if len(problem.starts) == len(problem.first_windows):
        return _by_their_beginning(problem, parameters)
    began = problem.initial.copy()
    told = _told_by_the_window_before(problem, parameters)
    if not np.isfinite(told).all():
        raise ModelError(
            f"{problem.system.model.name}: states that no channel shows diverged (NaN or infinite)"
            " from one window to the next"
        )
    began[:, problem.hidden] = told
    telling = np.zeros(problem.measured.shape[:2], np.bool_)
    telling[problem.first_windows] = True
    return _counted(problem, parameters, began, telling)


def _told_by_the_window_before(problem: Problem, parameters: FloatArray) -> FloatArray:
    """Hidden states in which each window begins, shape (windows, hidden)."""
    own = set(problem.hidden[problem.hidden < len(problem.system.model.states)].tolist())
    memory = np.array([column for column in problem.hidden if column not in own], np.int64)
    told = problem.initial.copy()
    rest = np.setdiff1d(np.arange(len(told)), problem.first_windows)
    order = _in_turn(problem) if len(memory) else [rest]
    for rows in order:
        ended = problem.ends_before(parameters, rows)
        told[rows] = ended
        # What effects remember goes on; the model's own states begin anew in the next window.
        problem.begin_at(rows, memory, ended[:, memory])
    return told[:, problem.hidden]


def _in_turn(problem: Problem) -> list[IntArray]:
    """Windows but the first of each recording; all second ones, then all third ones, …"""
    windows = np.arange(len(problem.starts))
    since = (
        windows
        - problem.first_windows[np.searchsorted(problem.first_windows, windows, side="right") - 1]
    )
    return [np.nonzero(since == turn)[0] for turn in range(1, int(since.max()) + 1)]


def _by_their_beginning(problem: Problem, parameters: FloatArray) -> Started:
    """Windows that are whole recordings, each told by its own first samples."""
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
    problem: Problem, parameters: FloatArray, began: FloatArray, telling: BoolArray
) -> Started:
    """Windows that begin there in what is hidden; samples that tell it do not count."""
    problem.hold(began, problem.hidden)
    problem.measured[telling] = np.nan
    error, slopes = problem.settle(parameters)
    return Started(parameters, problem.initial, error, slopes)

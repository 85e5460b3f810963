"""Fits a model with hidden states continued from window to window.

If each window has hidden states of its own, they take up part of what the model lacks, and the
parameters that fit best are not those that predict best. Here only the states that channels measure
begin anew in each window. Hidden states begin once in a recording, with values that are fitted, and
continue through all its windows, as in multiple shooting with equality constraints (H. Bock, in
Springer Series in Chemical Physics 18, 1981).

A window's measured states are its own least-squares problem and are projected out, as in `Problem`.
With q the parameters and the first hidden states, h the hidden states at a window's beginning and s
its measured states, sensitivities follow the windows by

    ds/dq = −S⁺·(∂e/∂q + ∂e/∂h·dh/dq),   dh⁺/dq = ∂h⁺/∂q + ∂h⁺/∂h·dh/dq + ∂h⁺/∂s·ds/dq

with e the window's error, S = ∂e/∂s, and h⁺ the hidden states at the beginning of the next window.
"""

from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from rigwatch.physics.engine.compile import CompiledSystem, rate_limit
from rigwatch.physics.engine.fit import (
    CLOSE,
    ENOUGH,
    FAR,
    QUIET,
    Fit,
    Prior,
    Problem,
    Recording,
    Started,
    Tangent,
    bounds,
    covariance_of,
    deviations,
    fit,
    result_of,
)
from rigwatch.physics.engine.search.hidden_states import has_hidden_states
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.errors import ModelError

CONVERGED = 1e-6
"""Relative fall of the squared error at which a fit ends."""
NEGLIGIBLE = 1e-8
"""Change of the error by an unknown's own size, relative to the error, below which it is kept."""
MOST = 30
"""Most evaluations of a fit."""


@QUIET
def fit_continued(
    compiled: CompiledSystem,
    recording: Recording,
    horizon: int,
    *,
    start: FloatArray | None = None,
    scale: FloatArray | None = None,
    initial: FloatArray | None = None,
    substeps: int = 4,
    prior: Prior | None = None,
) -> Fit:
    """`fit`, ended by one with hidden states continued; the same for a model that has none.

    Args:
        compiled, recording, horizon, start, scale, initial, substeps, prior: as in `fit`.

    Raises:
        ModelError: the recording is too short, or the model diverges at the start.
    """
    found = fit(
        compiled, recording, horizon, start=start, scale=scale, initial=initial,
        substeps=substeps, prior=prior,
    )  # fmt: skip
    if not has_hidden_states(compiled.system):
        return found
    windows = _ContinuedWindows(found, recording, horizon, substeps)
    return windows.fitted(prior) if windows.continue_anywhere else found


@QUIET
def fit_nearby(found: Fit, prior: Prior, recording: Recording, horizon: int, substeps: int) -> Fit:
    """A fit by `fit_continued`, moved to where a prior and the recording agree best.

    It starts where the fit ended, and keeps its `begun_anew`.

    Args:
        found: fitted by `fit_continued`.
        prior: as in `fit`.
        recording, horizon, substeps: what it was fitted to.

    Raises:
        ModelError: the model diverges.
    """
    if found.continued:
        return _ContinuedWindows(found, recording, horizon, substeps).fitted(prior)
    return _apart(found, recording, horizon, substeps, prior)


@QUIET
def begun_anew_nearby(found: Fit, recording: Recording, horizon: int, substeps: int) -> Fit:
    """A continued fit whose `begun_anew` is the optimum nearest to its own parameters.

    The one that it came from may lie in another valley, where an effect that the recording needs
    has the wrong sign.

    Args:
        found: fitted by `fit_continued`.
        recording, horizon, substeps: what it was fitted to.
    """
    if not found.continued:
        return found
    try:
        near = _apart(found, recording, horizon, substeps)
    except ModelError:
        return found
    return replace(found, begun_anew=near)


def _apart(
    found: Fit, recording: Recording, horizon: int, substeps: int, prior: Prior | None = None
) -> Fit:
    """The optimum nearest to a fit of windows that all begin anew."""
    return fit(
        found.compiled, recording, horizon, start=found.parameters, scale=found.scale,
        initial=found.initial, substeps=substeps, prior=prior,
    )  # fmt: skip


@QUIET
def continued_error_at(
    found: Fit, recording: Recording, horizon: int, substeps: int, parameters: FloatArray
) -> float:
    """Root mean square of the scaled error at other parameters; infinite if it diverges.

    Args:
        found: fitted by `fit_continued`.
        recording, horizon, substeps: what it was fitted to.
        parameters: all of them, shape (n_p,).
    """
    windows = _ContinuedWindows(found, recording, horizon, substeps)
    return windows.error_at(parameters)


class _Path(NamedTuple):
    """All windows at some values of the unknowns.

    Attributes:
        initial: initial states, shape (windows, states).
        error, slopes: scaled, and by free parameters and states, as in `Started`.
        residual, jacobian: measured states projected out, shapes (windows, k), (…, unknowns).
    """

    initial: FloatArray
    error: FloatArray
    slopes: FloatArray
    residual: FloatArray
    jacobian: FloatArray


class _ContinuedWindows:
    """Windows of a recording whose hidden states continue.

    The unknowns are the free parameters, then the hidden states of each recording's first window.
    """

    def __init__(self, found: Fit, recording: Recording, horizon: int, substeps: int) -> None:
        self._found = found
        problem = self._problem = Problem(
            found.compiled, recording, horizon, scale=found.scale, substeps=substeps,
            initial=found.initial,
        )  # fmt: skip
        problem.initial = found.initial.copy()
        self._hidden, self._m = problem.hidden, len(problem.free)
        self._shown = problem.measured_states
        self._fastest = rate_limit(found.compiled, found.parameters, recording.dt)
        self._first = problem.initial[np.ix_(problem.first_windows, self._hidden)]
        self._last: tuple[bytes, _Path] | None = None
        self._least = np.inf

    @property
    def continue_anywhere(self) -> bool:
        """Whether a recording has more than one window."""
        return len(self._problem.starts) > len(self._problem.first_windows)

    def fitted(self, prior: Prior | None) -> Fit:
        """The fit from the values found so far.

        Raises:
            ModelError: continued states diverge there.
        """
        begin = np.append(self._found.parameters[self._problem.free], self._first)
        path = self._path(begin)
        if path is None:
            raise ModelError(
                f"{self._problem.system.model.name}: states that no channel shows diverged (NaN or"
                " infinite) from one window to the next"
            )
        return self._result(self._least_squares(begin, prior))

    def error_at(self, parameters: FloatArray) -> float:
        """Error at parameters, the first hidden states moved to match, to first order."""
        theta = parameters[self._problem.free]
        here = self._path(np.append(self._found.parameters[self._problem.free], self._first))
        if here is None:
            return np.inf
        slopes = here.jacobian.reshape(here.residual.size, -1)
        step = theta - self._found.parameters[self._problem.free]
        left = here.residual.ravel() + slopes[:, : self._m] @ step
        moved = np.linalg.lstsq(slopes[:, self._m :], -left, rcond=None)[0]
        low, high = self._bounds()
        first = np.clip(self._first.ravel() + moved, low[self._m :], high[self._m :])
        there = self._path(np.append(theta, first))
        return np.inf if there is None else float(np.sqrt(np.mean(there.residual**2)))

    def _least_squares(self, begin: FloatArray, prior: Prior | None) -> FloatArray:
        """The unknowns of the smallest error near these.

        The solver's are scaled and offset as in `fit`: it moves what is within 1e-10 of a bound, in
        whatever unit, and a compliance of oil of 1e-13 m³/Pa always is.
        """
        low, high = self._bounds()
        size = self._problem.count
        begin = np.clip(begin, low, high)
        here = self._path(begin)
        assert here is not None
        residual, jacobian = here.residual.ravel(), here.jacobian.reshape(size, -1)
        unit = deviations(residual, jacobian, begin)
        # What has no influence, as a capacity that windows apart made infinite, stays.
        told = np.linalg.norm(jacobian, axis=0) * np.abs(begin)
        steps = unit * ((begin == 0) | (told > NEGLIGIBLE * np.linalg.norm(residual)))

        def unknowns(moved: FloatArray) -> FloatArray:
            return np.asarray(np.clip(begin + steps * (moved - FAR), low, high))

        def residuals(moved: FloatArray) -> FloatArray:
            q = unknowns(moved)
            path = self._path(q)
            own = np.full(size, np.nan) if path is None else path.residual.ravel()
            return own if prior is None else np.append(own, prior.error(q[: self._m]))

        def slopes(moved: FloatArray) -> FloatArray:
            path = self._path(unknowns(moved))
            own = np.zeros((size, len(steps))) if path is None else path.jacobian.reshape(size, -1)
            if prior is not None:
                weak = np.zeros((len(prior.slopes), len(steps)))
                weak[:, : self._m] = prior.slopes
                own = np.vstack([own, weak])
            return np.asarray(own * steps)

        try:
            with np.errstate(over="ignore", invalid="ignore"):
                found = scipy.optimize.least_squares(
                    residuals, np.full(len(begin), FAR), jac=slopes,
                    bounds=(FAR + (low - begin) / unit, FAR + (high - begin) / unit),
                    x_scale="jac", ftol=CONVERGED, xtol=CLOSE / FAR, max_nfev=MOST,
                )  # fmt: skip
        except (ValueError, np.linalg.LinAlgError) as error:
            raise ModelError(
                f"{self._problem.system.model.name}: the search diverged (NaN or infinite);"
                " try other starting values"
            ) from error
        return unknowns(found.x)

    @cached_property
    def _turns(self) -> list[tuple[IntArray, BoolArray]]:
        """Windows that are simulated together, and which of them a window follows."""
        problem = self._problem
        firsts, count = problem.first_windows, len(problem.starts)
        return [
            (rows, (rows + 1 < count) & ~np.isin(rows + 1, firsts))
            for rows in [firsts, *problem.window_order]
        ]

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the unknowns."""
        recordings = len(self._problem.first_windows)
        ends = zip(bounds(self._problem.system), self._problem.limits, strict=True)
        low, high = (np.append(own, np.tile(of[self._hidden], recordings)) for own, of in ends)
        return low, high

    def _path(self, q: FloatArray) -> _Path | None:
        """All windows at these unknowns; None if they diverge or are too fast for the recording."""
        key = q.tobytes()
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        parameters = self._problem.whole(self._found.parameters, q[: self._m])
        if self._problem.compiled.fastest(parameters) > self._fastest:
            return None
        path = self._run(parameters, q)
        if path is None:
            return None
        size = float(np.sum(path.residual**2))
        if size < self._least:
            # Measured states begin where they were best.
            self._least, self._problem.initial = size, path.initial
        self._last = (key, path)
        return path

    def _run(self, parameters: FloatArray, q: FloatArray) -> _Path | None:
        problem, hidden, m = self._problem, self._hidden, self._m
        problem.follow_inputs(parameters)
        firsts, count = problem.first_windows, len(problem.starts)
        initial = problem.initial.copy()
        initial[np.ix_(firsts, hidden)] = q[m:].reshape(len(firsts), len(hidden))
        turn = np.zeros((count, len(hidden), len(q)))
        turn[firsts] = np.eye(len(q))[m:].reshape(len(firsts), len(hidden), len(q))
        done: list[tuple[IntArray, _Path]] = []
        for rows, onward in self._turns:
            found = self._windows(parameters, rows, initial[rows], turn[rows])
            if found is None:
                return None
            path, ended, moved = found
            if not _finite(path.residual, path.jacobian, ended, moved):
                return None
            done.append((rows, path))
            initial[np.ix_(rows[onward] + 1, hidden)] = ended[onward]
            turn[rows[onward] + 1] = moved[onward]
        order = np.argsort(np.concatenate([rows for rows, _ in done]))
        parts = zip(*(path for _, path in done), strict=True)
        return _Path(*(np.concatenate(part)[order] for part in parts))

    def _windows(
        self, parameters: FloatArray, rows: IntArray, initial: FloatArray, turn: FloatArray
    ) -> tuple[_Path, FloatArray, FloatArray] | None:
        """Some windows with given hidden states, which depend on the unknowns by `turn`.

        Returns:
            The windows; the hidden states after them, and how these depend on the unknowns. None
            if a window diverges.
        """
        m, hidden = self._m, self._hidden
        initial, (error, slopes, ended, moved), tangent = self._settled(parameters, rows, initial)
        if tangent is None:
            return None
        by = slopes[..., m + hidden] @ turn
        by[..., :m] += slopes[..., :m]
        both = tangent.without(np.concatenate([error[..., None], by], axis=-1))
        own = -tangent.solve(by)
        low, high = (end[hidden] for end in self._problem.limits)
        after, by_states = ended[:, hidden], moved[:, hidden]
        following = by_states[..., m + hidden] @ turn + by_states[..., m:] @ own
        following[..., :m] += by_states[..., :m]
        inside = (after >= low) & (after <= high)
        path = _Path(initial, error, slopes, -both[..., 0], both[..., 1:])
        return path, np.clip(after, low, high), np.where(inside[..., None], following, 0.0)

    def _settled(
        self, parameters: FloatArray, rows: IntArray, initial: FloatArray
    ) -> tuple[FloatArray, tuple[FloatArray, FloatArray, FloatArray, FloatArray], Tangent | None]:
        """Windows with their measured states moved by a Gauss-Newton step where it helps.

        Returns:
            Initial states; the windows from there, as `Problem.simulated_to_next`; their tangent,
            None if a window diverges.
        """
        problem, found = self._problem, self._problem.simulated_to_next(parameters, rows, initial)
        error, slopes = found[:2]
        if not _finite(error, slopes):
            return initial, found, None
        tangent = self._tangent(slopes)
        if not len(self._shown):
            return initial, found, tangent
        step = tangent.solve(error[..., None])[..., 0]
        size = np.sum(error**2, axis=1)
        (moving,) = np.nonzero(problem.predicted_reduction(step, slopes) > ENOUGH * size)
        if not len(moving):
            return initial, found, tangent
        there = np.clip(initial[moving] + step[moving], *problem.limits)
        tried = problem.simulated_to_next(parameters, rows[moving], there)
        finite = np.isfinite(tried[1]).all(axis=(1, 2)) & np.isfinite(tried[3]).all(axis=(1, 2))
        better = (np.sum(tried[0] ** 2, axis=1) < size[moving]) & finite
        initial = initial.copy()
        initial[moving[better]] = there[better]
        for kept, new in zip(found, tried, strict=True):
            kept[moving[better]] = new[better]
        # What is not finite was not better, so that no window has diverged here.
        return initial, found, self._tangent(found[1]) if better.any() else tangent

    def _tangent(self, slopes: FloatArray) -> Tangent:
        return Tangent(slopes[..., self._m :], [(np.arange(len(slopes)), self._shown)])

    def _result(self, q: FloatArray) -> Fit:
        """The fit at these unknowns, the first hidden states projected out."""
        path, m, problem = self._path(q), self._m, self._problem
        assert path is not None
        parameters = problem.whole(self._found.parameters, q[:m])
        plain = result_of(problem, Started(parameters, path.initial, path.error, path.slopes))
        basis = np.linalg.qr(path.jacobian.reshape(path.residual.size, -1)[:, m:]).Q
        both = np.concatenate([path.residual[..., None], path.jacobian[..., :m]], axis=-1)
        flat = both.reshape(path.residual.size, 1 + m)
        flat = flat - basis @ (basis.T @ flat)
        residual, jacobian = flat[:, 0], flat[:, 1:]
        states = self._tangent(path.slopes).rank + self._first.size
        freedom = max(problem.measured_count - states - m, 1.0)
        return replace(
            plain,
            covariance=covariance_of(jacobian, float(residual @ residual) / freedom),
            freedom=freedom,
            error=residual.reshape(path.residual.shape),
            jacobian=jacobian.reshape(*path.residual.shape, m),
            begun_anew=self._found.begun_anew or self._found,
        )


def _finite(*values: FloatArray) -> bool:
    return all(bool(np.isfinite(each).all()) for each in values)

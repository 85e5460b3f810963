"""Output-error fits over short horizons, each with its own unknown initial state.

A recording is cut into windows. For given parameters p the initial states of every window are found
by Gauss-Newton steps of their own and projected out of residuals and Jacobian (variable projection
with Kaufman's gradient: G. Golub and V. Pereyra, Inverse Problems 19, 2003), so that SciPy's
bounded least squares sees the parameters alone.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from rigwatch.physics.engine.compiled import BoolArray, CompiledSystem, FloatArray, IntArray
from rigwatch.physics.engine.memory import Recall
from rigwatch.physics.engine.system import System
from rigwatch.physics.engine.tangent import Tangent
from rigwatch.physics.engine.thinning import Thinning
from rigwatch.wire.errors import ModelError

START_STEPS = 2
"""Simulations at most for the initial states at each evaluation; they start from the best ones."""

ENOUGH = 1e-3
"""Share of a window's squared error that a second one must promise."""

ROUNDS = 2
"""Solutions at most, each from where the last has led, while windows that went astray come back."""

ASTRAY = 2.0
"""Squared error of a window over the median of all from which its initial state may be wrong."""

BACK = 0.8
"""Share of its squared error to which a window must fall to have come back."""

SETTLED = 1e-6
"""Share of a window's squared error below which a better initial state is not looked for."""

FAR, CLOSE = 100.0, 0.01
"""Deviations: where a search begins, and steps that are not worth another simulation."""

CONVERGED = 1e-6
"""Fall of the squared error, over all of it, at which a fit ends; noise moves it by 1/samples."""


@dataclass(frozen=True, eq=False)
class Recording:
    """What was measured, for one model.

    Attributes:
        dt: time between samples [s].
        inputs: in the order of the model's inputs, shape (n, n_u).
        outputs: in the order of its outputs, shape (n, n_y); NaN where nothing valid was measured.
        thinning: how residuals and sensitivities are filtered and thinned, None where they are not.
    """

    dt: float
    inputs: FloatArray
    outputs: FloatArray
    thinning: Thinning | None = None

    def __len__(self) -> int:
        return len(self.inputs)


@dataclass(frozen=True, eq=False)
class Windows:
    """How a recording is cut.

    Attributes:
        starts: first sample of each window, shape (windows,).
        length: samples in each.
    """

    starts: IntArray
    length: int


def windows(system: System, samples: int, horizon: int) -> Windows:
    """Consecutive windows of `horizon` samples; without states the recording is one window.

    Raises:
        ModelError: the recording is shorter than one window.
    """
    length = samples if not system.states else min(horizon, samples)
    if length < 2:
        raise ModelError(f"{system.model.name}: found {samples} samples, expected at least 2")
    return Windows(np.arange(0, samples - length + 1, length, dtype=np.int64), length)


@dataclass(frozen=True, eq=False)
class Fit:
    """A system fitted to a recording.

    Attributes:
        compiled: what was fitted.
        parameters: all of them, shape (n_p,).
        covariance: of the free ones, shape (m, m), for white residuals of the size found.
        initial: initial states of the windows, shape (windows, states).
        residuals: measured less modelled, shape (windows, length, outputs), thinned where the
            recording is; else NaN where nothing valid was measured.
        scale: what each output's residuals were divided by, shape (outputs,).
        error: scaled residuals, initial states projected out, shape (windows, k).
        jacobian: ∂error/∂(free parameters), shape (windows, k, m).
    """

    compiled: CompiledSystem
    parameters: FloatArray
    covariance: FloatArray
    initial: FloatArray
    residuals: FloatArray
    scale: FloatArray
    error: FloatArray
    jacobian: FloatArray

    @property
    def rms(self) -> FloatArray:
        """Root mean square of the residuals of each output, shape (outputs,)."""
        return np.asarray(np.sqrt(np.nanmean(self.residuals**2, axis=(0, 1))))

    def rms_at(self, samples: BoolArray) -> FloatArray:
        """The same over some samples, given as truths of shape (windows, length)."""
        return np.asarray(np.sqrt(np.nanmean(self.residuals[samples] ** 2, axis=0)))

    def values(self) -> dict[str, float]:
        """Parameters by name."""
        names = self.compiled.system.parameters
        return dict(zip(names, self.parameters.tolist(), strict=True))

    def deviations(self) -> dict[str, float]:
        """Standard deviations of the free parameters by name."""
        sd = np.sqrt(np.diag(self.covariance))
        return dict(zip(self.compiled.system.free, sd.tolist(), strict=True))


# What blows up is looked at for being finite; it needs no warning as well.
_QUIET = np.errstate(over="ignore", invalid="ignore")


@_QUIET
def fit(
    compiled: CompiledSystem,
    recording: Recording,
    horizon: int,
    *,
    start: FloatArray | None = None,
    scale: FloatArray | None = None,
    initial: FloatArray | None = None,
    substeps: int = 4,
) -> Fit:
    """Parameters that make the short-horizon error of `compiled` smallest.

    Args:
        compiled: the system.
        recording: what it is fitted to.
        horizon: samples from one re-initialisation to the next.
        start: all parameters to start from, shape (n_p,); the model's own if None.
        scale: divisor of each output's residuals, shape (outputs,); its standard deviation if None.
        initial: states that the search begins with, those of the model first, shape (windows, …);
            as the channels show them if None.
        substeps: Runge-Kutta steps between samples, where nothing is stiff.

    Raises:
        ModelError: the recording is too short, or the model leaves the finite numbers at the start.
    """
    problem = _Problem(
        compiled, recording, horizon, scale=scale, substeps=substeps, initial=initial
    )
    begin = compiled.parameters if start is None else start.copy()
    theta = np.clip(begin[problem.free], *_bounds(compiled.system))
    problem.recall(problem.whole(begin, theta))
    found = problem.start_windows(problem.whole(begin, theta))
    for _ in range(ROUNDS if len(theta) else 0):
        theta = _smallest_error(problem, begin, theta)
        found = problem.start_windows(problem.whole(begin, theta))
        if not found.came_back:
            break
    return problem.result(found)


def _smallest_error(problem: "_Problem", begin: FloatArray, theta: FloatArray) -> FloatArray:
    """Free parameters at which SciPy's solver ends.

    It moves them in deviations, as the data at the start tell them, and calls a step small by the
    size of all that it moves. So it begins at `FAR`, whence a step of `CLOSE` deviations is small.
    """
    low, high = _bounds(problem.system)
    unit = _deviations(*problem.projected(problem.whole(begin, theta)), theta)

    def parameters(moved: FloatArray) -> FloatArray:
        return problem.whole(begin, np.clip(theta + unit * (moved - FAR), low, high))

    found = least_squares(
        lambda moved: problem.tried(parameters(moved)),
        np.full(len(theta), FAR),
        jac=lambda moved: problem.projected(parameters(moved))[1] * unit,
        bounds=(FAR + (low - theta) / unit, FAR + (high - theta) / unit),
        x_scale="jac",
        ftol=CONVERGED,
        xtol=CLOSE / FAR,
        max_nfev=60,
    )
    return np.asarray(parameters(found.x)[problem.free])


def _deviations(residual: FloatArray, jacobian: FloatArray, theta: FloatArray) -> FloatArray:
    """Each parameter's deviation while the others are known; its size where it shows nowhere."""
    slope = np.sqrt(np.sum(jacobian**2, axis=0))
    noise = np.sqrt(np.mean(residual**2))
    size = np.maximum(np.abs(theta), 1e-12)
    return np.where(slope > noise / (1e6 * size), noise / np.where(slope > 0, slope, 1.0), size)


@_QUIET
def evaluate(
    fitted: Fit,
    recording: Recording,
    horizon: int,
    substeps: int = 4,
    initial: FloatArray | None = None,
) -> Fit:
    """The same parameters on another recording: only its windows' initial states are fitted."""
    problem = _Problem(
        fitted.compiled, recording, horizon, scale=fitted.scale, substeps=substeps, initial=initial
    )
    problem.recall(fitted.parameters)
    found = problem.start_windows(fitted.parameters)
    return replace(problem.result(found), covariance=fitted.covariance)


@dataclass(frozen=True, eq=False)
class _Started:
    """Windows at their best initial states.

    Attributes:
        parameters: all of them, shape (n_p,).
        initial: shape (windows, states).
        error: scaled, shape (windows, k).
        slopes: by free parameters and initial states, shape (windows, k, free + states).
        came_back: whether a window that went astray came back.
    """

    parameters: FloatArray
    initial: FloatArray
    error: FloatArray
    slopes: FloatArray
    came_back: bool = False


@dataclass(frozen=True, eq=False)
class _Met:
    """The evaluation with the smallest error that the solver has met.

    Attributes:
        size: squared error, initial states projected out.
        parameters: all of them, shape (n_p,).
        initial: states that windows were simulated from, shape (windows, states).
    """

    size: float
    parameters: FloatArray
    initial: FloatArray


def _bounds(system: System) -> tuple[FloatArray, FloatArray]:
    free = [system.parameters[name] for name in system.free]
    return np.array([p.low for p in free]), np.array([p.high for p in free])


class _Problem:
    """One recording cut into windows, simulated at the parameters that the solver asks for."""

    def __init__(
        self,
        compiled: CompiledSystem,
        recording: Recording,
        horizon: int,
        *,
        scale: FloatArray | None,
        substeps: int,
        initial: FloatArray | None,
    ) -> None:
        self._compiled, self._recording, self._substeps = compiled, recording, substeps
        system = self.system = compiled.system
        names = list(system.parameters)
        self.free = np.array([names.index(name) for name in system.free], dtype=np.int64)
        self._cut = windows(system, len(recording), horizon)
        rows = self._cut.starts[:, None] + np.arange(self._cut.length)
        self._measured = recording.outputs[rows]
        self.scale = np.nanstd(recording.outputs, axis=0) if scale is None else scale
        self.scale = np.where(self.scale > 0, self.scale, 1.0)
        shown = initial_states(system, recording)
        self._initial = shown[self._cut.starts]
        self._offered = initial
        self._memory = Recall(system, recording.inputs, shown, recording.dt, compiled.parameters)
        known = self._memory.exact
        self._every = np.arange(len(system.states))
        self._unknown = np.array([i for i in self._every if i not in known], np.int64)
        self._low, self._high = (
            np.array([getattr(state, end) for state in system.states.values()])
            for end in ("low", "high")
        )
        self._best: _Met | None = None
        self._last: tuple[bytes, tuple[FloatArray, FloatArray]] | None = None

    def whole(self, begin: FloatArray, theta: FloatArray) -> FloatArray:
        """All parameters, with the free ones replaced."""
        parameters = begin.copy()
        parameters[self.free] = theta
        return parameters

    def recall(self, parameters: FloatArray) -> None:
        """Let the memory of effects begin where the measured signals have led it.

        Windows begin as the channels show them or, where it is better, as they are offered.
        """
        self._remember(parameters, self._memory.columns)
        if self._offered is None or len(self._offered) != len(self._initial):
            return
        rows, own = np.arange(len(self._initial)), len(self.system.model.states)
        other = np.column_stack([self._offered[:, :own], self._initial[:, own:]])
        shown, offered = (
            np.sum(self._simulated(parameters, rows, each)[0] ** 2, axis=1)
            for each in (self._initial, other)
        )
        self._initial = np.where((offered < shown)[:, None], other, self._initial)

    def _follow_inputs(self, parameters: FloatArray) -> None:
        """Let memory at actuators begin where the inputs lead it; what came first is fitted."""
        self._remember(parameters, self._memory.exact, since=1)

    def _remember(self, parameters: FloatArray, columns: list[int], since: int = 0) -> None:
        if columns:
            led = self._memory.at(parameters)
            self._initial = self._initial.copy()
            for column in columns:
                self._initial[since:, column] = led[column][self._cut.starts[since:]]

    def _simulated(
        self, parameters: FloatArray, rows: IntArray, initial: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Scaled residuals (rows, k), slopes (rows, k, free + states); 0 if unmeasured."""
        r = self._recording
        run = self._compiled.simulate(
            r.inputs, r.dt, self._cut.starts[rows], self._cut.length, initial=initial,
            parameters=parameters, substeps=self._substeps,
        )  # fmt: skip
        error = (self._measured[rows] - run.outputs) / self.scale
        slopes = run.slopes / self.scale[:, None]
        missing = np.isnan(self._measured[rows])
        if missing.any():
            error, slopes = np.where(missing, 0.0, error), np.where(missing[..., None], 0.0, slopes)
        if r.thinning:
            error, slopes = r.thinning.apply(error), r.thinning.apply(slopes)
        flat = error.reshape(len(error), -1)
        return flat, slopes.reshape(*flat.shape, slopes.shape[-1])

    def start_windows(self, parameters: FloatArray) -> _Started:
        """Settle, and let windows that went astray begin where the one before has ended.

        Initial states have local minima of their own.
        """
        if self._best is not None and np.array_equal(self._best.parameters, parameters):
            self._initial = self._best.initial
        error, slopes = self.settle(parameters)
        found, rows = _Started(parameters, self._initial, error, slopes), _astray(error)
        if not (self.system.states and len(rows)):
            return found
        self._initial = self._initial.copy()
        self._initial[rows] = self._ends_before(parameters, rows)
        try:
            again, again_slopes = self.settle(parameters, rows=rows)
        except ModelError:
            self._initial = found.initial
            return found
        back = np.sum(again**2, axis=1) < BACK * np.sum(error[rows] ** 2, axis=1)
        error[rows[back]], slopes[rows[back]] = again[back], again_slopes[back]
        self._initial[rows[~back]] = found.initial[rows[~back]]
        self._best = self._last = None
        return _Started(parameters, self._initial, error, slopes, bool(back.any()))

    def _ends_before(self, parameters: FloatArray, rows: IntArray) -> FloatArray:
        """States in which the windows before some have ended, shape (rows, states)."""
        r, before = self._recording, rows - 1
        run = self._compiled.simulate(
            r.inputs, r.dt, self._cut.starts[before], self._cut.length + 1,
            initial=self._initial[before], parameters=parameters, substeps=self._substeps,
        )  # fmt: skip
        ended = np.clip(run.last, self._low, self._high)
        return np.where(np.isfinite(ended), ended, self._initial[rows])

    def settle(
        self,
        parameters: FloatArray,
        steps: int = 6,
        *,
        worth: float = SETTLED,
        rows: IntArray | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Move the initial states to where they fit best; scaled residuals and slopes there.

        Each window takes Gauss-Newton steps of its own until they are worth nothing. A step that
        makes its error larger, as one that leaves the play of a valve does, is tried again at a
        quarter of its length.

        Args:
            parameters: all of them, shape (n_p,).
            steps: simulations at most.
            worth: share of a window's squared error that a step must promise.
            rows: windows that are settled, all if None.
        """
        self._follow_inputs(parameters)
        rows = np.arange(len(self._initial)) if rows is None else rows
        best = self._initial[rows]
        error, slopes = self._simulated(parameters, rows, best)
        if not (np.isfinite(slopes).all() and np.isfinite(error).all()):
            raise ModelError(
                f"{self.system.model.name}: the simulation leaves the finite numbers;"
                " try other starting values or more substeps"
            )
        if not self.system.states:
            return error, slopes
        step = self._steps(error, slopes, rows)
        for _ in range(steps - 1):
            size = np.sum(error**2, axis=1)
            (going,) = np.nonzero(self._promise(step, slopes) > worth * size)
            if not len(going):
                break
            there = np.clip(best[going] + step[going], self._low, self._high)
            tried, tried_slopes = self._simulated(parameters, rows[going], there)
            better = np.sum(tried**2, axis=1) < size[going]
            took = going[better]
            best[took], error[took], slopes[took] = (
                there[better],
                tried[better],
                tried_slopes[better],
            )
            step[took] = self._steps(error[took], slopes[took], rows[took])
            step[going[~better]] /= 4
        self._initial = self._initial.copy()
        self._initial[rows] = best
        return error, slopes

    def _promise(self, step: FloatArray, slopes: FloatArray) -> FloatArray:
        """What a step takes away of each window's squared error to first order."""
        moved = slopes[..., len(self.free) :] @ step[..., None]
        return np.asarray(np.sum(moved[..., 0] ** 2, axis=1))

    def _steps(self, error: FloatArray, slopes: FloatArray, rows: IntArray) -> FloatArray:
        """Gauss-Newton step of each window's initial state, shape (rows, states)."""
        return np.asarray(self._tangent(slopes, rows).solve(error[..., None])[..., 0])

    def _tangent(self, slopes: FloatArray, rows: IntArray) -> Tangent:
        """What an input led to is known, but at the recording's beginning."""
        first = np.nonzero(rows == 0)[0], np.nonzero(rows > 0)[0]
        groups = list(zip(first, (self._every, self._unknown), strict=True))
        if len(self._unknown) == len(self._every):
            groups = [(np.arange(len(rows)), self._every)]
        return Tangent(slopes[..., len(self.free) :], groups)

    def projected(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and Jacobian by the free parameters, initial states projected out."""
        key = parameters.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, self._project(parameters))
        return self._last[1]

    def tried(self, parameters: FloatArray) -> FloatArray:
        """Residuals for the solver; NaN where the simulation blows up, and it steps back."""
        before = self._initial
        try:
            return self.projected(parameters)[0]
        except ModelError:
            self._initial = before
            return np.full(self.count, np.nan)

    @property
    def count(self) -> int:
        """Residuals that the solver sees."""
        shape = (self._measured.shape[0], self._measured.shape[1], 1)
        thinning = self._recording.thinning
        thinned = thinning.apply(np.zeros(shape)).shape if thinning else shape
        return math.prod(thinned) * int(self._measured.shape[2])

    def _project(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self._best is not None:
            self._initial = self._best.initial
        found = self._cleaned(*self.settle(parameters, START_STEPS, worth=ENOUGH))
        size = float(found[0] @ found[0])
        if self._best is None or size < self._best.size:
            self._best = _Met(size, parameters.copy(), self._initial)
        return found

    def _cleaned(self, error: FloatArray, slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residual and Jacobian without what the initial states could have made."""
        m = len(self.free)
        tangent = self._tangent(slopes, np.arange(len(slopes)))
        both = tangent.without(np.concatenate([error[..., None], slopes[..., :m]], axis=-1))
        return -both[..., 0].ravel(), both[..., 1:].reshape(error.size, m)

    def result(self, found: _Started) -> Fit:
        """The fit at the parameters that have been found."""
        error = found.error
        residual, jacobian = self._cleaned(error, found.slopes)
        used = residual.size - found.initial.size - len(self.free)
        variance = float(residual @ residual) / max(used, 1)
        covariance = np.asarray(np.linalg.pinv(jacobian.T @ jacobian) * variance, np.float64)
        left = error.reshape(len(error), -1, self._measured.shape[2]) * self.scale
        if self._recording.thinning is None:
            left = np.where(np.isnan(self._measured), np.nan, left)
        return Fit(
            self._compiled,
            found.parameters,
            covariance,
            found.initial,
            left,
            self.scale,
            residual.reshape(len(error), -1),
            jacobian.reshape(len(error), -1, len(self.free)),
        )


def _astray(error: FloatArray) -> IntArray:
    """Windows, but the first, whose squared error is beyond that of most."""
    size = np.sum(error**2, axis=1)
    return np.nonzero(size[1:] > ASTRAY * np.median(size))[0] + 1


def initial_states(system: System, recording: Recording) -> FloatArray:
    """States as the channels show them at every sample, shape (n, states): a start for the fit."""
    channels = {
        output.channel or name: recording.outputs[:, index]
        for index, (name, output) in enumerate(system.model.outputs.items())
    }
    found = np.empty((len(recording), len(system.states)))
    for index, state in enumerate(system.states.values()):
        found[:, index] = state.start
        if state.measured in channels:
            found[:, index] = _filled(channels[state.measured])
        elif state.rate_of in channels:
            signal = _filled(channels[state.rate_of])
            width = min(11, len(signal) - 1 + len(signal) % 2)
            if width >= 5:
                found[:, index] = savgol_filter(signal, width, 3, deriv=1, delta=recording.dt)
    return found


def _filled(signal: FloatArray) -> FloatArray:
    """The signal with gaps bridged by straight lines; zeros where there is nothing at all."""
    good = np.isfinite(signal)
    if not good.any():
        return np.zeros_like(signal)
    at = np.arange(len(signal))
    return np.interp(at, at[good], signal[good])

"""Output-error fits over short horizons, each with its own unknown initial state.

A recording is cut into windows. `Problem` takes their initial states out of the fit; so SciPy's
bounded least squares sees the parameters alone.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from rigwatch.physics.engine.compile import CompiledSystem
from rigwatch.physics.engine.equations import System
from rigwatch.physics.engine.fit.continued_windows import continued
from rigwatch.physics.engine.fit.problem import Problem, Started
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError

ROUNDS = 2
"""Solutions at most, each from where the last has led, while windows that went astray come back."""

FAR, CLOSE = 100.0, 0.01
"""Deviations: where a search begins, and steps that are not worth another simulation."""

SETTLED = 1e-10
"""The same where a prior counts, which is next to nothing beside the recording."""

CONVERGED = 1e-6
"""Fall of the squared error, over all of it, at which a fit ends; noise moves it by 1/samples."""


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the free parameters beside the recording.

    Attributes:
        centre: where they probably are, shape (m,).
        slopes: of scaled residuals by the distance from there, shape (k, m).
    """

    centre: FloatArray
    slopes: FloatArray

    def error(self, theta: FloatArray) -> FloatArray:
        """Scaled residuals of the free parameters, shape (k,)."""
        return np.asarray(self.slopes @ (theta - self.centre))


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
    prior: Prior | None = None,
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
        prior: what pulls at the parameters beside the recording.

    Raises:
        ModelError: the recording is too short, or the model diverges at the start.
    """
    problem = Problem(compiled, recording, horizon, scale=scale, substeps=substeps, initial=initial)
    begin = compiled.parameters if start is None else start.copy()
    theta = np.clip(begin[problem.free], *bounds(compiled.system))
    problem.recall(problem.whole(begin, theta))
    found = problem.start_windows(problem.whole(begin, theta))
    for _ in range(ROUNDS if len(theta) else 0):
        theta = _smallest_error(problem, begin, theta, prior)
        found = problem.start_windows(problem.whole(begin, theta))
        if not found.came_back:
            break
    return result_of(problem, found)


def _smallest_error(
    problem: Problem, begin: FloatArray, theta: FloatArray, prior: Prior | None
) -> FloatArray:
    """Free parameters at which SciPy's solver ends.

    It moves them in deviations, as the data at the start tell them, and calls a step small by the
    size of all that it moves. So it begins at `FAR`, whence a step of `CLOSE` deviations is small.
    """
    low, high = bounds(problem.system)
    unit = _deviations(*problem.projected(problem.whole(begin, theta)), theta)

    def parameters(moved: FloatArray) -> FloatArray:
        return problem.whole(begin, np.clip(theta + unit * (moved - FAR), low, high))

    def residuals(moved: FloatArray) -> FloatArray:
        at = parameters(moved)
        own = problem.tried(at)
        return own if prior is None else np.append(own, prior.error(at[problem.free]))

    def slopes(moved: FloatArray) -> FloatArray:
        own = problem.projected(parameters(moved))[1]
        return (own if prior is None else np.vstack([own, prior.slopes])) * unit

    try:
        found = least_squares(
            residuals,
            np.full(len(theta), FAR),
            jac=slopes,
            bounds=(FAR + (low - theta) / unit, FAR + (high - theta) / unit),
            x_scale="jac",
            ftol=CONVERGED if prior is None else SETTLED,
            xtol=CLOSE / FAR,
            max_nfev=60,
        )
    except (ValueError, np.linalg.LinAlgError) as error:
        # Slopes that are finite may still be too large to be squared.
        raise ModelError(
            f"{problem.system.model.name}: the search diverged (NaN or infinite);"
            " try other starting values"
        ) from error
    return np.asarray(parameters(found.x)[problem.free])


def _deviations(residual: FloatArray, jacobian: FloatArray, theta: FloatArray) -> FloatArray:
    """Each parameter's deviation while the others are known; its size where it shows nowhere."""
    slope = np.sqrt(np.sum(jacobian**2, axis=0))
    noise = np.sqrt(np.mean(residual**2))
    # What begins at zero has no size of its own, and moves as the data tell it.
    size = np.where(theta != 0, np.abs(theta), np.inf)
    told = slope > noise / (1e6 * size)
    return np.where(told, noise / np.where(slope > 0, slope, 1.0), np.where(theta != 0, size, 1.0))


@_QUIET
def evaluate(
    fitted: Fit,
    recording: Recording,
    horizon: int,
    substeps: int = 4,
    initial: FloatArray | None = None,
    *,
    judging: bool = False,
) -> Fit:
    """The same parameters on another recording: only its windows' initial states are fitted.

    Args:
        fitted: the parameters.
        recording, horizon, substeps, initial: as in `fit`.
        judging: whether samples that count may tell only states that channels show.
    """
    problem = Problem(
        fitted.compiled, recording, horizon, scale=fitted.scale, substeps=substeps, initial=initial
    )
    problem.recall(fitted.parameters)
    start = continued if judging else Problem.start_windows
    found = start(problem, fitted.parameters)
    return replace(result_of(problem, found), covariance=fitted.covariance)


@_QUIET
def error_at(  # noqa: PLR0917 -- they belong together
    compiled: CompiledSystem,
    recording: Recording,
    horizon: int,
    parameters: FloatArray,
    scale: FloatArray | None,
    substeps: int = 4,
) -> float:
    """Root mean square of the scaled error at given parameters; infinite where it blows up.

    Args:
        compiled, recording, horizon, substeps: as in `fit`.
        parameters: all of them, shape (n_p,).
        scale: divisor of each output's residuals, shape (outputs,); its standard deviation if None.
    """
    problem = Problem(compiled, recording, horizon, scale=scale, substeps=substeps, initial=None)
    try:
        problem.recall(parameters)
        error = problem.start_windows(parameters).error
    except (ModelError, np.linalg.LinAlgError):
        return float("inf")
    size = float(np.sqrt(np.mean(error**2)))
    return size if np.isfinite(size) else float("inf")


def bounds(system: System) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of the free parameters, each of shape (m,)."""
    free = [system.parameters[name] for name in system.free]
    return np.array([p.low for p in free]), np.array([p.high for p in free])


def result_of(problem: Problem, found: Started) -> Fit:
    """The fit at the parameters that have been found."""
    error, scale = found.error, problem.scale
    residual, jacobian = problem.cleaned(error, found.slopes)
    curvature = jacobian.T @ jacobian
    if not np.isfinite(curvature).all():
        raise ModelError(
            f"{problem.system.model.name}: the sensitivities diverged (NaN or infinite); try other"
            " starting values"
        )
    outputs, m = problem.measured.shape[2], len(problem.free)
    counted = problem.whole_recording(error.reshape(len(error), -1, outputs))
    used = counted.size - found.initial.size - m
    variance = float(residual @ residual) / max(used, 1)
    covariance = np.asarray(np.linalg.pinv(curvature) * variance, np.float64)
    left = counted * scale
    if problem.recording.thinning is None:
        left = np.where(np.isnan(problem.whole_recording(problem.measured)), np.nan, left)
    cleaned = np.concatenate([residual[:, None], jacobian], axis=1)
    cleaned = problem.whole_recording(cleaned.reshape(len(error), -1, outputs, 1 + m))
    cleaned = cleaned.reshape(len(cleaned), -1, 1 + m)
    return Fit(
        problem.compiled,
        found.parameters,
        covariance,
        found.initial,
        left,
        scale,
        cleaned[..., 0],
        cleaned[..., 1:],
    )

"""Output-error fits over short horizons, each with its own unknown initial state.

A recording is divided into windows. `Problem` eliminates their initial states, so SciPy's bounded
least squares sees only the parameters.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from rigwatch.physics.engine.compile import CompiledSystem, resolved_from
from rigwatch.physics.engine.equations import System
from rigwatch.physics.engine.fit.continued_windows import continued
from rigwatch.physics.engine.fit.problem import STEPS, Problem, Started
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError

ROUNDS = 2
"""Most solver runs, each started from the last result, while diverged windows recover."""

NEARER = 4
"""Most solver runs towards modes that are as fast as the recording resolves."""

FAR, CLOSE = 100.0, 0.01
"""Start of a search, and smallest step worth a simulation, in standard deviations."""

SETTLED = 1e-10
"""The same with a prior, which is weak compared with the recording."""

CONVERGED = 1e-6
"""Relative fall of the squared error at which a fit ends; noise changes it by 1/samples."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Prior knowledge of the free parameters.

    Attributes:
        centre: prior means, shape (m,).
        slopes: of scaled residuals by the distance from the means, shape (k, m).
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
        compiled: the fitted system.
        parameters: all parameters, shape (n_p,).
        covariance: of the free ones, shape (m, m), assuming white residuals of the rms found.
        initial: initial states of the windows, shape (windows, states).
        residuals: measured minus modelled, shape (windows, length, outputs), decimated if the
            recording is; otherwise NaN without a valid sample.
        scale: divisor of each output's residuals, shape (outputs,).
        error: scaled residuals, initial states projected out, shape (windows, k).
        jacobian: ∂error/∂(free parameters), shape (windows, k, m).
        freedom: measured residuals, less the initial states that they determine and the free
            parameters; at least 1.
        begun_anew: of a fit whose hidden states continue from window to window, the one before in
            which they begin anew in each, as measured ones do; None for others.
    """

    compiled: CompiledSystem
    parameters: FloatArray
    covariance: FloatArray
    initial: FloatArray
    residuals: FloatArray
    scale: FloatArray
    error: FloatArray
    jacobian: FloatArray
    freedom: float = 1.0
    begun_anew: "Fit | None" = None

    @property
    def continued(self) -> bool:
        """Whether hidden states continue from window to window."""
        return self.begun_anew is not None

    @property
    def rms(self) -> FloatArray:
        """Root mean square of the residuals of each output, shape (outputs,)."""
        return np.asarray(np.sqrt(np.nanmean(self.residuals**2, axis=(0, 1))))

    def rms_at(self, samples: BoolArray) -> FloatArray:
        """The same over samples selected by a mask of shape (windows, length)."""
        return np.asarray(np.sqrt(np.nanmean(self.residuals[samples] ** 2, axis=0)))

    def values(self) -> dict[str, float]:
        """Parameters by name."""
        names = self.compiled.system.parameters
        return dict(zip(names, self.parameters.tolist(), strict=True))

    def deviations(self) -> dict[str, float]:
        """Standard deviations of the free parameters by name."""
        sd = np.sqrt(np.diag(self.covariance))
        return dict(zip(self.compiled.system.free, sd.tolist(), strict=True))


# Results are checked for being finite; NumPy's warnings are redundant.
QUIET = np.errstate(over="ignore", invalid="ignore")


@QUIET
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
    """Fit: parameters that minimise the short-horizon error of `compiled`.

    Args:
        compiled: the system.
        recording: the recording to fit.
        horizon: samples from one re-initialisation to the next.
        start: initial values of all parameters, shape (n_p,); the model's own if None.
        scale: divisor of each output's residuals, shape (outputs,); its standard deviation if None.
        initial: initial states, those of the model first, shape (windows, …); from the channels if
            None.
        substeps: Runge-Kutta steps between samples for non-stiff systems.
        prior: prior knowledge of the parameters.

    Raises:
        ModelError: the recording is too short, or the model diverges at the start.
    """
    problem = Problem(compiled, recording, horizon, scale=scale, substeps=substeps, initial=initial)
    begin = compiled.parameters if start is None else start.copy()
    theta = np.clip(begin[problem.free], *bounds(compiled.system))
    problem.recall(problem.whole(begin, theta))
    found = problem.start_windows(problem.whole(begin, theta))
    for _ in range(ROUNDS if len(theta) else 0):
        theta = _resolved_minimum(problem, begin, theta, prior)
        found = problem.start_windows(problem.whole(begin, theta))
        if not found.came_back:
            break
    return result_of(problem, found)


def _resolved_minimum(
    problem: Problem, begin: FloatArray, theta: FloatArray, prior: Prior | None
) -> FloatArray:
    """Free parameters of the smallest error among those whose modes the recording resolves."""
    problem.resolve_rates(problem.whole(begin, theta))
    theta = _smallest_error(problem, begin, theta, prior, bounds(problem.system))
    for _ in range(NEARER):
        if not problem.unresolved:
            break
        # The solver stops short of a limit that is none of its bounds.
        here = problem.whole(begin, theta)
        problem.resolve_rates(here)
        within = bounds(resolved_from(problem.system, here, problem.recording.dt))
        theta = _smallest_error(problem, begin, theta, prior, within)
    return theta


def _smallest_error(
    problem: Problem,
    begin: FloatArray,
    theta: FloatArray,
    prior: Prior | None,
    within: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Free parameters at which SciPy's solver ends, between the lower and upper bounds `within`.

    The solver's unknowns are scaled by the standard deviations at the start. Its step tolerance is
    relative to the norm of the unknowns, so they are offset to `FAR`, which makes a step of `CLOSE`
    standard deviations small.
    """
    low, high = within
    unit = deviations(*problem.projected(problem.whole(begin, theta)), theta)

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
        with np.errstate(over="ignore", invalid="ignore"):
            found = scipy.optimize.least_squares(
                residuals, np.full(len(theta), FAR), jac=slopes,
                bounds=(FAR + (low - theta) / unit, FAR + (high - theta) / unit),
                x_scale="jac", ftol=CONVERGED if prior is None else SETTLED, xtol=CLOSE / FAR,
                max_nfev=60,
            )  # fmt: skip
    except (ValueError, np.linalg.LinAlgError) as error:
        # Finite slopes may still overflow when squared.
        raise ModelError(
            f"{problem.system.model.name}: the search diverged (NaN or infinite);"
            " try other starting values"
        ) from error
    return np.asarray(parameters(found.x)[problem.free])


def deviations(residual: FloatArray, jacobian: FloatArray, theta: FloatArray) -> FloatArray:
    """Each parameter's standard deviation given the others.

    Its size if it has no influence, or if nothing is left to explain.
    """
    slope = np.sqrt(np.sum(jacobian**2, axis=0))
    noise = np.sqrt(np.mean(residual**2))
    # A parameter that starts at zero has no size; only its standard deviation is used.
    size = np.where(theta != 0, np.abs(theta), np.inf)
    told = (slope > noise / (1e6 * size)) & (noise > 0)
    return np.where(told, noise / np.where(slope > 0, slope, 1.0), np.where(theta != 0, size, 1.0))


@QUIET
def evaluate(
    fitted: Fit,
    recording: Recording,
    horizon: int,
    substeps: int = 4,
    initial: FloatArray | None = None,
    *,
    judging: bool = False,
    steps: int = STEPS,
) -> Fit:
    """The same parameters on another recording; only its windows' initial states are fitted.

    Args:
        fitted: the parameters.
        recording, horizon, substeps, initial: as in `fit`.
        judging: whether counted samples may only determine states that channels measure.
        steps: most simulations that fit the initial states, unless judging.
    """
    problem = Problem(
        fitted.compiled, recording, horizon, scale=fitted.scale, substeps=substeps, initial=initial
    )
    problem.recall(fitted.parameters)
    if judging:
        found = continued(problem, fitted.parameters)
    else:
        found = problem.start_windows(fitted.parameters, steps)
    return replace(result_of(problem, found), covariance=fitted.covariance)


@QUIET
def error_at(  # noqa: PLR0917 -- they belong together
    compiled: CompiledSystem,
    recording: Recording,
    horizon: int,
    parameters: FloatArray,
    scale: FloatArray | None,
    substeps: int = 4,
) -> float:
    """Root mean square of the scaled error at given parameters; infinite if it diverges.

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


def covariance_of(jacobian: FloatArray, variance: float) -> FloatArray:
    """Covariance of the free parameters, shape (m, m), whatever the units that they are in.

    Without equal columns a parameter of 1e3 beside one of 1e-13 would count as undetermined.

    Args:
        jacobian: of the residuals, shape (residuals, m).
        variance: of a residual.
    """
    size = np.linalg.norm(jacobian, axis=0)
    size = np.where(size > 0, size, 1.0)
    unit = jacobian / size
    return np.asarray(np.linalg.pinv(unit.T @ unit) * variance / np.outer(size, size))


def result_of(problem: Problem, found: Started) -> Fit:
    """The fit at the parameters found."""
    error, scale = found.error, problem.scale
    tangent = problem.tangent(found.slopes)
    residual, jacobian = problem.cleaned(error, found.slopes, tangent)
    curvature = jacobian.T @ jacobian
    if not np.isfinite(curvature).all():
        raise ModelError(
            f"{problem.system.model.name}: the sensitivities diverged (NaN or infinite); try other"
            " starting values"
        )
    outputs, m = problem.measured.shape[2], len(problem.free)
    counted = problem.whole_recording(error.reshape(len(error), -1, outputs))
    freedom = max(problem.measured_count - tangent.rank - m, 1.0)
    covariance = covariance_of(jacobian, float(residual @ residual) / freedom)
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
        freedom,
    )

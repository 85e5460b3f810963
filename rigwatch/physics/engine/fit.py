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

from rigwatch.physics.engine.compiled import CompiledSystem, FloatArray, IntArray
from rigwatch.physics.engine.system import System
from rigwatch.physics.engine.thinning import Thinning
from rigwatch.wire.errors import ModelError

START_STEPS = 2
"""Gauss-Newton steps for the initial states at each evaluation; they start from the last ones."""


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

    def values(self) -> dict[str, float]:
        """Parameters by name."""
        names = self.compiled.system.parameters
        return dict(zip(names, self.parameters.tolist(), strict=True))

    def deviations(self) -> dict[str, float]:
        """Standard deviations of the free parameters by name."""
        sd = np.sqrt(np.diag(self.covariance))
        return dict(zip(self.compiled.system.free, sd.tolist(), strict=True))


def fit(
    compiled: CompiledSystem,
    recording: Recording,
    horizon: int,
    *,
    start: FloatArray | None = None,
    scale: FloatArray | None = None,
    substeps: int = 4,
) -> Fit:
    """Parameters that make the short-horizon error of `compiled` smallest.

    Args:
        compiled: the system.
        recording: what it is fitted to.
        horizon: samples from one re-initialisation to the next.
        start: all parameters to start from, shape (n_p,); the model's own if None.
        scale: divisor of each output's residuals, shape (outputs,); its standard deviation if None.
        substeps: Runge-Kutta steps between samples.

    Raises:
        ModelError: the recording is too short, or the model leaves the finite numbers at the start.
    """
    problem = _Problem(compiled, recording, horizon, scale=scale, substeps=substeps)
    begin = compiled.parameters if start is None else start.copy()
    if not compiled.system.free:
        return problem.result(begin)
    low, high = _bounds(compiled.system)
    free = problem.free
    inside = np.clip(begin[free], low, high)
    problem.settle(problem.whole(begin, inside))
    if not np.isfinite(problem.tried(problem.whole(begin, inside))).all():
        raise ModelError(
            f"{compiled.system.model.name}: the simulation leaves the finite numbers at the start;"
            " try other starting values or more substeps"
        )
    found = least_squares(
        lambda theta: problem.tried(problem.whole(begin, theta)),
        inside,
        jac=lambda theta: problem.projected(problem.whole(begin, theta))[1],
        bounds=(low, high),
        x_scale="jac",
        max_nfev=60,
    )
    return problem.result(problem.whole(begin, found.x))


def evaluate(fitted: Fit, recording: Recording, horizon: int, substeps: int = 4) -> Fit:
    """The same parameters on another recording: only its windows' initial states are fitted."""
    problem = _Problem(fitted.compiled, recording, horizon, scale=fitted.scale, substeps=substeps)
    problem.settle(fitted.parameters)
    return replace(problem.result(fitted.parameters), covariance=fitted.covariance)


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
    ) -> None:
        self._compiled, self._recording, self._substeps = compiled, recording, substeps
        system = compiled.system
        names = list(system.parameters)
        self.free = np.array([names.index(name) for name in system.free], dtype=np.int64)
        self._cut = windows(system, len(recording), horizon)
        rows = self._cut.starts[:, None] + np.arange(self._cut.length)
        self._measured = recording.outputs[rows]
        self.scale = np.nanstd(recording.outputs, axis=0) if scale is None else scale
        self.scale = np.where(self.scale > 0, self.scale, 1.0)
        self._initial = initial_states(system, recording)[self._cut.starts]
        self._last: tuple[bytes, tuple[FloatArray, FloatArray]] | None = None

    def whole(self, begin: FloatArray, theta: FloatArray) -> FloatArray:
        """All parameters, with the free ones replaced."""
        parameters = begin.copy()
        parameters[self.free] = theta
        return parameters

    def _simulated(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Scaled residuals (windows, k), slopes (windows, k, free + states); 0 if unmeasured."""
        r = self._recording
        run = self._compiled.simulate(
            r.inputs, r.dt, self._cut.starts, self._cut.length, initial=self._initial,
            parameters=parameters, substeps=self._substeps,
        )  # fmt: skip
        error = (self._measured - run.outputs) / self.scale
        slopes = run.slopes / self.scale[:, None]
        missing = np.isnan(self._measured)
        if missing.any():
            error, slopes = np.where(missing, 0.0, error), np.where(missing[..., None], 0.0, slopes)
        if r.thinning:
            error, slopes = r.thinning.apply(error), r.thinning.apply(slopes)
        flat = error.reshape(len(error), -1)
        return flat, slopes.reshape(*flat.shape, slopes.shape[-1])

    def settle(self, parameters: FloatArray, steps: int = 4) -> None:
        """Move the initial states to where they fit best."""
        m = len(self.free)
        if not self._compiled.system.states:
            return
        for _ in range(steps):
            error, slopes = self._simulated(parameters)
            if not (np.isfinite(slopes).all() and np.isfinite(error).all()):
                raise ModelError(
                    f"{self._compiled.system.model.name}: the simulation leaves the finite numbers;"
                    " try other starting values or more substeps"
                )
            step = [
                np.linalg.lstsq(j, e, rcond=1e-10)[0]
                for j, e in zip(slopes[..., m:], error, strict=True)
            ]
            self._initial = self._initial + np.array(step)

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
            residual = self.projected(parameters)[0]
        except ModelError:
            residual = np.full(self.count, np.nan)
        if not np.isfinite(residual).all():
            self._initial = before
        return residual

    @property
    def count(self) -> int:
        """Residuals that the solver sees."""
        shape = (self._measured.shape[0], self._measured.shape[1], 1)
        thinning = self._recording.thinning
        thinned = thinning.apply(np.zeros(shape)).shape if thinning else shape
        return math.prod(thinned) * int(self._measured.shape[2])

    def _project(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        m = len(self.free)
        self.settle(parameters, START_STEPS)
        error, slopes = self._simulated(parameters)
        by_parameter, by_start = slopes[..., :m], slopes[..., m:]
        if by_start.shape[-1]:
            q = np.linalg.qr(by_start).Q
            error = error - np.einsum("wki,wi->wk", q, np.einsum("wki,wk->wi", q, error))
            along = np.einsum("wki,wkj->wij", q, by_parameter)
            by_parameter = by_parameter - np.einsum("wki,wij->wkj", q, along)
        return -error.ravel(), by_parameter.reshape(-1, m)

    def result(self, parameters: FloatArray) -> Fit:
        """The fit at these parameters."""
        residual, jacobian = self.projected(parameters)
        error, _ = self._simulated(parameters)
        if not np.isfinite(error).all():
            raise ModelError(
                f"{self._compiled.system.model.name}: the simulation leaves the finite numbers;"
                " try other starting values or more substeps"
            )
        used = residual.size - self._initial.size - len(self.free)
        variance = float(residual @ residual) / max(used, 1)
        covariance = np.asarray(np.linalg.pinv(jacobian.T @ jacobian) * variance, np.float64)
        left = error.reshape(len(error), -1, self._measured.shape[2]) * self.scale
        if self._recording.thinning is None:
            left = np.where(np.isnan(self._measured), np.nan, left)
        return Fit(
            self._compiled,
            parameters,
            covariance,
            self._initial,
            left,
            self.scale,
            residual.reshape(len(error), -1),
            jacobian.reshape(len(error), -1, len(self.free)),
        )


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

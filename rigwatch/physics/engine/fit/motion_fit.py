"""Fits a model along the measured motion to recordings from afar: from a model's default values.

What is simulated is stable and in one piece, so that its error bends gently over decades of the
parameters. Positive ones are moved by their logarithms, every one within its bounds; a robust loss
keeps samples at which the model fails from pulling at all the others,

    min Σ ρ(r²),   ρ(z) = 2·(√(1 + z) - 1)   (soft L1: B. Triggs et al., Bundle Adjustment, 2000)

with r in deviations of the channel's noise. A weak prior holds each parameter near its default
where the data do not say anything. The initial states are unknowns like any other. Where the first
search ends well above the noise, others start from values spread about the defaults, over a part of
the recording, and the best is carried on over all of it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from rigwatch.physics.engine.compile import CompiledSystem
from rigwatch.physics.engine.fit.convergence import Convergence, convergence
from rigwatch.physics.engine.fit.problem import Problem
from rigwatch.physics.engine.fit.recording import Recording, initial_states
from rigwatch.physics.engine.fit.windowed_fit import Fit, result_of
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError

ROBUST = 2.0
"""Deviations of noise from which a residual counts less than by its square."""
PRIOR = 0.3
"""Deviations of noise that a parameter may cost when it is off by a factor of e."""
SPREAD = 0.6
"""Standard deviation of the starts about the defaults, in logarithms."""
STARTS = 5
"""Searches beside the one from the defaults, where that ends above `GOOD`."""
GOOD = 1.3
"""Error over the channels' noise from which no other start is tried."""
NEAR = 3.0
"""Error over the channels' noise from which another search must lead to the same end."""
LOOK, POLISH = 25, 60
"""Simulations at most: of a first look over a part of a recording, and over all of it."""
PART = 2048
"""Samples of a first look."""
BLOWN_UP = 1e3
"""Deviations that count where a simulation diverges."""


@dataclass(frozen=True, eq=False)
class _Scaled:
    """How unknowns are moved: value = start·e^z where it is a logarithm, else start + size·z.

    Attributes:
        start, size: shape (unknowns,).
        logarithmic: shape (unknowns,).
        low, high: bounds of z, shape (unknowns,).
    """

    start: FloatArray
    size: FloatArray
    logarithmic: BoolArray
    low: FloatArray
    high: FloatArray

    def value(self, z: FloatArray) -> FloatArray:
        grown = self.start * np.exp(np.where(self.logarithmic, z, 0.0))
        return np.where(self.logarithmic, grown, self.start + self.size * z)

    def slope(self, z: FloatArray) -> FloatArray:
        return np.where(self.logarithmic, self.value(z), self.size)


def fit_along_motion(
    compiled: CompiledSystem,
    recording: Recording,
    *,
    start: FloatArray | None = None,
    scale: FloatArray,
    substeps: int = 2,
) -> tuple[Fit, Convergence]:
    """Parameters fitted along the measured motion, over the recording in one piece; how it ended.

    Args:
        compiled: of a model that `along_measured_motion` made, with effects.
        recording: of `motion_recording`.
        start: all parameters, shape (n_p,); the model's own if None.
        scale: noise of each output, shape (outputs,).
        substeps: Runge-Kutta steps between samples.

    Raises:
        ModelError: the simulation diverges from every start.
    """
    search = _Search(compiled, recording, start, scale, substeps)
    looks = [search.run(search.origin, POLISH)]
    if looks[0].rms > GOOD and search.count:
        rng = np.random.default_rng(0)
        part = _Search(compiled, _first(recording, PART), start, scale, substeps)
        spread = SPREAD * rng.standard_normal((STARTS, search.count))
        found = [part.run(part.begun(z), LOOK) for z in spread]
        best = min(found, key=lambda look: look.cost)
        looks.append(search.run(search.begun(best.z[: search.count]), POLISH))
    best, *others = sorted(looks, key=lambda look: look.cost)
    if not np.isfinite(best.rms):
        raise ModelError(
            f"{compiled.system.model.name}: the simulation along the measured motion diverges;"
            " try other starting values or more substeps"
        )
    kept = search.result(best)
    ended = [search.result(other) for other in others if other.rms < BLOWN_UP]
    begun = "the values to start from" if best is looks[0] else "the best of several starts"
    return kept, convergence(kept, ended, begun, near_noise=best.rms <= NEAR, gradient=best.promise)


def _first(recording: Recording, samples: int) -> Recording:
    return Recording(recording.dt, recording.inputs[:samples], recording.outputs[:samples])


@dataclass(frozen=True, eq=False)
class _Look:
    """Where a search ended.

    Attributes:
        z: unknowns as they are moved, shape (unknowns,).
        cost: robust; infinite where it diverged.
        rms: of the residual, in deviations of noise.
        promise: share of the cost that a further Gauss-Newton step promises.
    """

    z: FloatArray
    cost: float
    rms: float
    promise: float


class _Search:
    """Simulations of one recording, as functions of scaled unknowns: parameters, initial states."""

    def __init__(
        self,
        compiled: CompiledSystem,
        recording: Recording,
        start: FloatArray | None,
        scale: FloatArray,
        substeps: int,
    ) -> None:
        self._compiled, self._recording, self._scale = compiled, recording, scale
        self._substeps = substeps
        names = list(compiled.system.parameters)
        self._free = np.array([names.index(name) for name in compiled.system.free], np.int64)
        self._begin = compiled.parameters if start is None else start.copy()
        self._first = initial_states(compiled.system, recording)[0]
        self._missing = np.isnan(recording.outputs)
        self._scaled = _scaled(compiled, self._begin[self._free], self._first)
        self._last: tuple[bytes, tuple[FloatArray, FloatArray]] | None = None
        self.count = len(self._free)
        self.origin = np.zeros(self.count + len(self._first))

    def begun(self, z: FloatArray) -> FloatArray:
        """Unknowns with these parameters, within their bounds, and the initial states as given."""
        whole = self.origin.copy()
        whole[: self.count] = z
        return np.clip(whole, self._scaled.low + 1e-9, self._scaled.high - 1e-9)

    def run(self, z: FloatArray, most: int) -> _Look:
        """The search from z, with `most` simulations."""
        if not len(z):
            residual = self._evaluated(z)[0]
            rms = float(np.sqrt(np.mean(residual**2)))
            return _Look(z, float(residual @ residual) / 2, rms, 0.0)
        found = least_squares(
            lambda at: self._evaluated(at)[0],
            np.clip(z, self._scaled.low, self._scaled.high),
            jac=lambda at: self._evaluated(at)[1],
            bounds=(self._scaled.low, self._scaled.high),
            loss="soft_l1",
            f_scale=ROBUST,
            ftol=1e-4,
            xtol=1e-4,
            max_nfev=most,
        )
        residual = found.fun[: -len(z)]
        counted = max(int(np.sum(~self._missing)), 1)
        rms = float(np.sqrt(residual @ residual / counted))
        moving = found.active_mask == 0
        step = np.linalg.lstsq(found.jac[:, moving].T @ found.jac[:, moving], found.grad[moving])[0]
        promised = float(found.grad[moving] @ step) / max(2 * float(found.cost), 1e-300)
        return _Look(found.x, float(found.cost), rms, promised)

    def _evaluated(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and their slopes by the unknowns, the priors' rows below."""
        key = z.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, self._simulated(z))
        return self._last[1]

    def _simulated(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        r, values = self._recording, self._scaled.value(z)
        parameters = self._begin.copy()
        parameters[self._free] = values[: self.count]
        with np.errstate(over="ignore", invalid="ignore"):
            run = self._compiled.simulate(
                r.inputs, r.dt, np.zeros(1, np.int64), len(r),
                initial=values[None, self.count :], parameters=parameters,
                substeps=self._substeps,
            )  # fmt: skip
            error = (run.outputs[0] - r.outputs) / self._scale
            slopes = run.slopes[0] / self._scale[:, None] * self._scaled.slope(z)
        error = np.where(self._missing, 0.0, error)
        slopes = np.where(self._missing[..., None], 0.0, slopes)
        if not (np.isfinite(error).all() and np.isfinite(slopes).all()):
            error, slopes = np.full_like(error, BLOWN_UP), np.zeros_like(slopes)
        if r.thinning:
            error, slopes = r.thinning.apply(error[None])[0], r.thinning.apply(slopes[None])[0]
        held = PRIOR * np.eye(len(z))
        return (
            np.concatenate([error.ravel(), PRIOR * z]),
            np.concatenate([slopes.reshape(-1, len(z)), held]),
        )

    def result(self, look: _Look) -> Fit:
        """The fit at the end of a search."""
        values = self._scaled.value(look.z)
        parameters = self._begin.copy()
        parameters[self._free] = values[: self.count]
        problem = Problem(
            self._compiled, self._recording, len(self._recording), scale=self._scale,
            substeps=self._substeps, initial=values[None, self.count :],
        )  # fmt: skip
        problem.recall(parameters)
        return result_of(problem, problem.start_windows(parameters))


def _scaled(compiled: CompiledSystem, start: FloatArray, first: FloatArray) -> _Scaled:
    """Free parameters, those that must be positive as logarithms, and initial states."""
    system = compiled.system
    free = [system.parameters[name] for name in system.free]
    states = list(system.states.values())
    low = np.array([*(p.low for p in free), *(s.low for s in states)])
    high = np.array([*(p.high for p in free), *(s.high for s in states)])
    whole = np.concatenate([np.clip(start, low[: len(free)], high[: len(free)]), first])
    positive = (low >= 0) & (whole > 0)
    positive[len(free) :] = False
    size = _sizes(whole, low, high)
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.where(positive, np.log(np.maximum(low, 1e-4 * whole) / whole), 0.0)
        most = np.where(positive, np.log(high / whole), 0.0)
    return _Scaled(
        whole,
        size,
        positive,
        np.minimum(np.where(positive, least, (low - whole) / size), -1e-6),
        np.maximum(np.where(positive, most, (high - whole) / size), 1e-6),
    )


def _sizes(values: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """How far one unit moves an unknown: its value, else a tenth of its range, else 1."""
    span = np.where(np.isfinite(high - low), high - low, 10.0) / 10
    return np.where(values != 0, np.abs(values), np.where(span > 0, span, 1.0))

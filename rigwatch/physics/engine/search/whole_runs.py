"""Fits a model along the measured motion, over whole recordings, from a model's default values.

What is simulated is stable and in one piece, so that its error bends gently over decades of the
parameters (see `unknowns.py`). A robust loss keeps samples at which the model fails from pulling at
all the others,

    min Σ ρ(r²),   ρ(z) = 2·(√(1 + z) - 1)   (soft L1: B. Triggs et al., Bundle Adjustment, 2000)

with r in deviations of the channel's noise. A prior holds each parameter near its centre where the
data do not say anything. The initial states are unknowns like any other. Where the first search
ends well above the noise, others start from values spread about the centre, over a part of each
recording, and the best is carried on over all of it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares, lsq_linear

from rigwatch.physics.engine.compile import CompiledSystem
from rigwatch.physics.engine.fit import Fit, Problem, Recording, beginning, joined, result_of
from rigwatch.physics.engine.search.convergence import PROMISED
from rigwatch.physics.engine.search.fit_from_afar import Attempt
from rigwatch.physics.engine.search.unknowns import Unknowns, unknowns
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

ROBUST = 2.0
"""Deviations of noise from which a residual counts less than by its square, if not told."""
PRIOR = 0.3
"""Deviations of noise that a parameter may cost when it is off by a factor of e."""
SPREAD = 0.6
"""Standard deviation of the starts about the centre, in logarithms."""
STARTS = 5
"""Searches beside the one from the given values, if not told."""
GOOD = 1.3
"""Error over the channels' noise up to which no other start is tried."""
NEAR = 3.0
"""Error over the channels' noise from which another search must lead to the same end."""
LOOK, POLISH = 25, 60
"""Simulations at most: of a first look over a part of a recording, and over all of it."""
ROUNDS = 3
"""Times at most that a search over all of it goes on, for as long as a further step promises."""
REACH = 1.0
"""Units, factors of e for what must be positive, to which a linearisation is believed."""
PART = 2048
"""Samples of a first look."""
BLOWN_UP = 1e3
"""Deviations that count where a simulation diverges."""


@dataclass(frozen=True, eq=False)
class _Look:
    """Where a search ended.

    Attributes:
        z: unknowns as they are moved, shape (unknowns,).
        cost: robust.
        rms: of the residual, in deviations of noise.
        promise: share of the cost that a further Gauss-Newton step promises.
    """

    z: FloatArray
    cost: float
    rms: float
    promise: float


class WholeRuns:
    """What `fit_from_afar` searches along the measured motion.

    Args:
        compiled: of a model that `along_measured_motion` made, with effects.
        recordings: of `motion_recording`, each simulated in one piece.
        scale: noise of each output, shape (outputs,).
        start: all parameters to begin with and to hold to, shape (n_p,); the model's own if None.
        pull: deviations of noise that a free parameter may cost when it is off by a factor of e,
            or by its size, shape (m,); `PRIOR` if None.
        sizes: how far one unit moves a free parameter, shape (m,), see `unknowns`.
        initial: states to begin with, shape (recordings, states); as channels show them if None.
        robust: deviations of noise from which a residual counts less than by its square.
        substeps: Runge-Kutta steps between samples.
        starts: searches beside the one from the given values, where that ends above `GOOD`.
    """

    def __init__(
        self,
        compiled: CompiledSystem,
        recordings: Sequence[Recording],
        scale: FloatArray,
        *,
        start: FloatArray | None = None,
        pull: FloatArray | None = None,
        sizes: FloatArray | None = None,
        initial: FloatArray | None = None,
        robust: float = ROBUST,
        substeps: int = 2,
        starts: int = STARTS,
    ) -> None:
        self._compiled, self._recordings, self._scale = compiled, recordings, scale
        self._robust, self._substeps, self._starts = robust, substeps, starts
        self._begin = compiled.parameters if start is None else start
        self._problem = self._posed(initial)
        self._m, first = len(self._problem.free), self._problem.initial
        self._sizes = np.full(self._m, np.nan) if sizes is None else sizes
        self._unknowns = self._about(first)
        held = np.full(self._m, PRIOR) if pull is None else pull
        self._pull = np.concatenate([held, np.full(first.size, PRIOR)])
        present = np.isfinite(self._problem.measured)
        self._counted = max(np.mean(present) * self._problem.count, 1.0)
        self._last: tuple[bytes, tuple[FloatArray, FloatArray]] | None = None

    def _posed(self, initial: FloatArray | None) -> Problem:
        whole = joined(self._recordings)
        return Problem(
            self._compiled, whole, len(whole), scale=self._scale, substeps=self._substeps,
            initial=initial, apart=len(self._recordings) > 1,
        )  # fmt: skip

    def _about(self, first: FloatArray) -> Unknowns:
        """Free parameters, then the initial states of each recording."""
        system = self._compiled.system
        states = [*system.states.values()] * len(first)
        ends = [*(system.parameters[name] for name in system.free), *states]
        centre = np.concatenate([self._begin[self._problem.free], first.ravel()])
        low, high = (np.array([getattr(each, end) for each in ends]) for end in ("low", "high"))
        told = np.concatenate([self._sizes, np.full(first.size, np.nan)])
        return unknowns(centre, low, high, positive=self._m, sizes=told)

    def attempts(self) -> Iterator[Callable[[], Attempt]]:
        """The given values; then the best of several about them."""
        yield lambda: self._attempt("the values to start from", np.zeros(self._unknowns.size.size))
        if self._starts:
            yield lambda: self._attempt("the best of several starts", self._drawn())

    def enough(self, found: Sequence[Attempt]) -> bool:
        """Whether little more than noise is left, or nothing can be moved."""
        return found[0].error <= GOOD or not self._m

    def near_noise(self, best: Attempt) -> bool:
        """Whether no other end could be much better."""
        return best.error <= NEAR

    def _attempt(self, begun: str, z: FloatArray) -> Attempt:
        look = self._polished(z)
        if look.rms >= BLOWN_UP:
            raise ModelError(
                f"{self._compiled.system.model.name}: the simulation along the measured motion"
                " diverges; try other starting values or more substeps"
            )
        return Attempt(begun, self._fit(look), look.cost, look.rms, look.promise)

    def _drawn(self) -> FloatArray:
        """Where the best of several starts leads over a part of each recording."""
        parts = [beginning(each, PART) for each in self._recordings]
        part = WholeRuns(
            self._compiled, parts, self._scale, start=self._begin, pull=self._pull[: self._m],
            sizes=self._sizes, initial=self._problem.initial, robust=self._robust,
            substeps=self._substeps,
        )  # fmt: skip
        spread = SPREAD * np.random.default_rng(0).standard_normal((self._starts, self._m))
        looks = [part._run(part._begun(z), LOOK) for z in spread]
        return self._begun(min(looks, key=lambda look: look.cost).z[: self._m])

    def _begun(self, z: FloatArray) -> FloatArray:
        """Unknowns with these parameters, within their bounds, and the initial states as given."""
        whole = np.zeros(self._unknowns.size.size)
        whole[: self._m] = z
        return self._unknowns.inside(whole)

    def _polished(self, z: FloatArray) -> _Look:
        """The search from z over all of the recordings."""
        look = self._run(z, POLISH)
        for _ in range(ROUNDS):
            if look.promise <= PROMISED or look.rms >= BLOWN_UP:
                break
            further = self._run(look.z, POLISH)
            # Along a bent valley a linearisation promises what a whole round does not find.
            found = 1 - further.cost / look.cost
            look = replace(further, promise=min(further.promise, found))
        return look

    def _run(self, z: FloatArray, most: int) -> _Look:
        """The search from z, with `most` simulations."""
        if not len(z):
            residual = self._evaluated(z)[0]
            rms = float(np.sqrt(residual @ residual / self._counted))
            return _Look(z, float(residual @ residual) / 2, rms, 0.0)
        low, high = self._unknowns.low, self._unknowns.high
        found = least_squares(
            lambda at: self._evaluated(at)[0],
            np.clip(z, low, high),
            jac=lambda at: self._evaluated(at)[1],
            bounds=(low, high),
            loss="soft_l1" if np.isfinite(self._robust) else "linear",
            f_scale=self._robust if np.isfinite(self._robust) else 1.0,
            ftol=1e-4,
            xtol=1e-4,
            max_nfev=most,
        )
        residual = found.fun[: -len(z)]
        rms = float(np.sqrt(residual @ residual / self._counted))
        promised = _promise(found, low, high)
        return _Look(found.x, float(found.cost), rms, promised)

    def _evaluated(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and their slopes by the unknowns, the priors' rows below."""
        key = z.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, self._simulated(z))
        return self._last[1]

    def _simulated(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        parameters, initial = self._told(z)
        with np.errstate(over="ignore", invalid="ignore"):
            error, own = self._problem.simulated(parameters, np.arange(len(initial)), initial)
            slopes = _beside(own, self._m) * self._unknowns.slope(z)
        if not (np.isfinite(error).all() and np.isfinite(slopes).all()):
            error, slopes = np.full_like(error, BLOWN_UP), np.zeros_like(slopes)
        return (
            np.concatenate([-error.ravel(), self._pull * z]),
            np.concatenate([slopes, np.diag(self._pull)]),
        )

    def _told(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """All parameters, and the initial states, shape (recordings, states)."""
        values = self._unknowns.value(z)
        parameters = self._problem.whole(self._begin, values[: self._m])
        return parameters, values[self._m :].reshape(self._problem.initial.shape)

    def _fit(self, look: _Look) -> Fit:
        """The fit at the end of a search."""
        parameters, initial = self._told(look.z)
        problem = self._posed(initial)
        problem.recall(parameters)
        return result_of(problem, problem.start_windows(parameters))


def _beside(slopes: FloatArray, m: int) -> FloatArray:
    """Slopes (recordings, k, m + states) by all unknowns: each recording has its own states."""
    count, k, _ = slopes.shape
    found = np.zeros((count, k, m + count * (slopes.shape[2] - m)))
    found[..., :m] = slopes[..., :m]
    for row, own in enumerate(np.split(found[..., m:], count, axis=2)):
        own[row] = slopes[row, :, m:]
    return found.reshape(count * k, -1)


def _promise(found: OptimizeResult, low: FloatArray, high: FloatArray) -> float:
    """Share of the cost that a Gauss-Newton step promises, within the bounds and `REACH`."""
    root = np.linalg.qr(found.jac)[1]
    wanted = -np.linalg.lstsq(root.T, found.grad)[0]
    least, most = np.maximum(low - found.x, -REACH), np.minimum(high - found.x, REACH)
    step = lsq_linear(root, wanted, (least - 1e-12, most + 1e-12)).x
    fall = -float(found.grad @ step) - float(np.sum((root @ step) ** 2)) / 2
    return fall / max(float(found.cost), 1e-300)

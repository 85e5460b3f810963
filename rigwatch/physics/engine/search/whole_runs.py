"""Fits a model along the measured motion, over whole recordings, from its default values.

The simulation is one stable run, so the error varies smoothly over decades of the parameters (see
`unknowns.py`). A robust loss limits the influence of samples at which the model fails,

    min Σ ρ(r²),   ρ(z) = 2·(√(1 + z) - 1)   (soft L1: B. Triggs et al., Bundle Adjustment, 2000)

with r in standard deviations of the channel's noise. A prior keeps undetermined parameters near
their centre. The initial states are further unknowns. If the first search ends well above the
noise, others start from values spread around the centre, over a part of each recording, and the
best is continued over the whole.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares, lsq_linear

from rigwatch.physics.engine.compile import CompiledSystem, side_by_side
from rigwatch.physics.engine.fit import Fit, Problem, Recording, beginning, joined, result_of
from rigwatch.physics.engine.search.convergence import PROMISED
from rigwatch.physics.engine.search.multi_start_fit import Attempt
from rigwatch.physics.engine.search.unknowns import Unknowns, unknowns
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

ROBUST = 2.0
"""Default transition of the robust loss from quadratic to linear [standard deviations of noise]."""
PRIOR = 0.3
"""Prior cost of a parameter that is off by a factor of e [standard deviations of noise]."""
SPREAD = 0.6
"""Standard deviation of the starts around the centre, in natural logarithms."""
STARTS = 5
"""Default number of further searches if the one from the given values ends above `GOOD`."""
GOOD = 1.3
"""Ratio of error to noise below which no other start is tried."""
NOISE = 1.1
"""The same of a thorough search: other optima, with parameters far away, leave little more."""
NEAR = 3.0
"""Ratio of error to noise above which another search must reach the same optimum."""
LOOK, POLISH = 25, 60
"""Most simulations of a first search over a part of a recording, and of one over the whole."""
CLOSE = 1.3
"""Ratio of costs up to which a first search is continued over its part of the recording."""
BRIEF = 15
"""Most simulations of a brief search."""
ROUNDS = 3
"""Most continuations of a search over the whole while a further step predicts a reduction."""
REACH = 1.0
"""Range of validity of a linearisation, in units of z (factors of e if logarithmic)."""
PART = 2048
"""Number of samples of a first search."""
BLOWN_UP = 1e3
"""Residual assigned to a diverged simulation [standard deviations of noise]."""
LARGEST = 1e100
"""Residual, or slope of one, from which a simulation has diverged: its square overflows."""


@dataclass(frozen=True, eq=False)
class _Look:
    """Result of a search.

    Attributes:
        z: scaled unknowns, shape (unknowns,).
        cost: robust cost.
        rms: of the residual, in standard deviations of noise.
        promise: predicted relative reduction of the cost by a further Gauss-Newton step.
    """

    z: FloatArray
    cost: float
    rms: float
    promise: float


class WholeRuns:
    """Search of `multi_start_fit` along the measured motion.

    Args:
        compiled: a model from `along_measured_motion`, with effects.
        recordings: from `motion_recording`, each simulated in one run.
        scale: noise of each output, shape (outputs,).
        start: initial values and prior means of all parameters, shape (n_p,); the model's own if
            None.
        pull: prior cost of a free parameter that is off by a factor of e, or by its size, in
            standard deviations of noise, shape (m,); `PRIOR` if None.
        sizes: units of the free parameters, shape (m,), see `unknowns`.
        initial: initial states, shape (recordings, states); from the channels if None.
        robust: transition of the robust loss to linear [standard deviations of noise].
        substeps: Runge-Kutta steps between samples.
        starts: number of further searches if the one from the given values ends above `GOOD`.
        thorough: whether they begin above `NOISE` already, and each is searched to its end.
        brief: whether one search of `BRIEF` simulations is enough, where the values to start from
            are near.
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
        thorough: bool = False,
        brief: bool = False,
    ) -> None:
        self._compiled, self._recordings, self._scale = compiled, recordings, scale
        self._robust, self._substeps = robust, substeps
        self._starts, self._thorough = 0 if brief else starts, thorough
        self._most, self._rounds = (BRIEF, 0) if brief else (POLISH, ROUNDS)
        self._begin = compiled.parameters if start is None else start
        self._problem = self._posed(initial)
        self._m, first = len(self._problem.free), self._problem.initial
        self._sizes = np.full(self._m, np.nan) if sizes is None else sizes
        self._unknowns = self._about(first)
        held = np.full(self._m, PRIOR) if pull is None else pull
        self._pull = np.concatenate([held, np.full(first.size, PRIOR)])
        present = np.isfinite(self._problem.measured)
        self._counted = max(np.mean(present) * self._problem.count, 1.0)

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
        """The given values; then the best of several around them."""
        yield lambda: self._attempt("the values to start from", np.zeros(self._unknowns.size.size))
        if self._starts:
            yield lambda: self._attempt("the best of several starts", self._drawn())

    def enough(self, found: Sequence[Attempt]) -> bool:
        """Whether the error is near the noise, or there is no free parameter."""
        return found[0].error <= (NOISE if self._thorough else GOOD) or not self._m

    def near_noise(self, best: Attempt) -> bool:
        """Whether no other optimum could be much better."""
        return best.error <= NEAR

    def first_search(self) -> tuple[dict[str, float], float]:
        """All parameters by name where the search from the given values ends, and the error there.

        The error is in standard deviations of noise, over all channels.

        Raises:
            ModelError: the simulation diverges.
        """
        look = self._converging(np.zeros(self._unknowns.size.size))
        names = self._compiled.system.parameters
        return dict(zip(names, self._split(look.z)[0].tolist(), strict=True)), look.rms

    def _converging(self, z: FloatArray) -> _Look:
        """The search from z.

        Raises:
            ModelError: the simulation diverges.
        """
        look = self._polished(z)
        if look.rms >= BLOWN_UP:
            raise ModelError(
                f"{self._compiled.system.model.name}: the simulation along the measured motion"
                " diverges; try other starting values or more substeps"
            )
        return look

    def _attempt(self, begun: str, z: FloatArray) -> Attempt:
        look = self._converging(z)
        return Attempt(begun, self._fit(look), look.cost, look.rms, look.promise)

    def _drawn(self) -> FloatArray:
        """Result of the best of several starts over a part of each recording."""
        parts = [beginning(each, PART) for each in self._recordings]
        part = WholeRuns(
            self._compiled, parts, self._scale, start=self._begin, pull=self._pull[: self._m],
            sizes=self._sizes, initial=self._problem.initial, robust=self._robust,
            substeps=self._substeps,
        )  # fmt: skip
        spread = SPREAD * np.random.default_rng(0).standard_normal((self._starts, self._m))
        looks = side_by_side(lambda z: part._run(part._begun(z), LOOK), list(spread))
        if self._thorough:
            # Along a curved valley a first search ends before it shows where it leads.
            least = CLOSE * min(look.cost for look in looks)
            close = [look for look in looks if look.cost <= least]
            looks += side_by_side(lambda look: part._run(look.z, POLISH), close)
        return self._begun(min(looks, key=lambda look: look.cost).z[: self._m])

    def _begun(self, z: FloatArray) -> FloatArray:
        """Unknowns for these parameters, within their bounds, and the given initial states."""
        whole = np.zeros(self._unknowns.size.size)
        whole[: self._m] = z
        return self._unknowns.inside(whole)

    def _polished(self, z: FloatArray) -> _Look:
        """The search from z over all of the recordings."""
        look = self._run(z, self._most)
        for _ in range(self._rounds):
            if look.promise <= PROMISED or look.rms >= BLOWN_UP:
                break
            further = self._run(look.z, self._most)
            # In a curved valley a linearisation predicts a reduction that a full round misses.
            found = 1 - further.cost / look.cost
            look = replace(further, promise=min(further.promise, found))
        return look

    def _run(self, z: FloatArray, most: int) -> _Look:
        """The search from z, with `most` simulations."""
        if not len(z):
            residual = self._simulated(z)[0]
            rms = float(np.sqrt(residual @ residual / self._counted))
            return _Look(z, float(residual @ residual) / 2, rms, 0.0)
        low, high = self._unknowns.low, self._unknowns.high
        evaluated = Latest(self._simulated)
        with np.errstate(over="ignore", invalid="ignore"):
            found = least_squares(
                lambda at: evaluated(at)[0], np.clip(z, low, high),
                jac=lambda at: evaluated(at)[1], bounds=(low, high),
                loss="soft_l1" if np.isfinite(self._robust) else "linear",
                f_scale=self._robust if np.isfinite(self._robust) else 1.0,
                ftol=1e-4, xtol=1e-4, max_nfev=most,
            )  # fmt: skip
        residual = found.fun[: -len(z)]
        rms = float(np.sqrt(residual @ residual / self._counted))
        promised = _promise(found, low, high)
        return _Look(found.x, float(found.cost), rms, promised)

    def _simulated(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and their slopes by the unknowns, followed by the rows of the priors."""
        parameters, initial = self._split(z)
        with np.errstate(over="ignore", invalid="ignore"):
            error, own = self._problem.simulated(parameters, np.arange(len(initial)), initial)
            slopes = _block_columns(own, self._m) * self._unknowns.slope(z)
        if not (_is_tame(error) and _is_tame(slopes)):
            error, slopes = np.full_like(error, BLOWN_UP), np.zeros_like(slopes)
        return (
            np.concatenate([-error.ravel(), self._pull * z]),
            np.concatenate([slopes, np.diag(self._pull)]),
        )

    def _split(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """All parameters, and the initial states, shape (recordings, states)."""
        values = self._unknowns.value(z)
        parameters = self._problem.whole(self._begin, values[: self._m])
        return parameters, values[self._m :].reshape(self._problem.initial.shape)

    def _fit(self, look: _Look) -> Fit:
        """The fit at the end of a search."""
        parameters, initial = self._split(look.z)
        problem = self._posed(initial)
        problem.recall(parameters)
        return result_of(problem, problem.start_windows(parameters))


def _is_tame(values: FloatArray) -> bool:
    """Whether all are finite, and small enough to be squared."""
    return bool(np.all(np.abs(values) < LARGEST))


class Latest:
    """A function of unknowns whose value where it was last evaluated is not computed again."""

    def __init__(self, function: Callable[[FloatArray], tuple[FloatArray, FloatArray]]) -> None:
        self._function, self._at = function, b""
        self._value: tuple[FloatArray, FloatArray] | None = None

    def __call__(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Its value at z."""
        key = z.tobytes()
        if self._value is None or self._at != key:
            self._value, self._at = self._function(z), key
        return self._value


def _block_columns(slopes: FloatArray, m: int) -> FloatArray:
    """Slopes (recordings, k, m + states) by all unknowns: each recording has its own states."""
    count, k, _ = slopes.shape
    found = np.zeros((count, k, m + count * (slopes.shape[2] - m)))
    found[..., :m] = slopes[..., :m]
    for row, own in enumerate(np.split(found[..., m:], count, axis=2)):
        own[row] = slopes[row, :, m:]
    return found.reshape(count * k, -1)


def _promise(found: OptimizeResult, low: FloatArray, high: FloatArray) -> float:
    """Predicted relative reduction of the cost by a Gauss-Newton step within bounds, `REACH`."""
    root = np.linalg.qr(found.jac)[1]
    wanted = -np.linalg.lstsq(root.T, found.grad)[0]
    least, most = np.maximum(low - found.x, -REACH), np.minimum(high - found.x, REACH)
    step = lsq_linear(root, wanted, (least - 1e-12, most + 1e-12)).x
    fall = -float(found.grad @ step) - float(np.sum((root @ step) ** 2)) / 2
    return fall / max(float(found.cost), 1e-300)

"""One recording divided into windows, with their unknown initial states eliminated from the fit.

For given parameters the initial states of every window are found by separate Gauss-Newton steps and
projected out of residuals and Jacobian (variable projection with Kaufman's gradient: G. Golub and
V. Pereyra, Inverse Problems 19, 2003), so the solver sees only the parameters.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, Simulation, rate_limit
from rigwatch.physics.engine.fit.initial_state_projection import Tangent
from rigwatch.physics.engine.fit.recorded_effect_states import RecordedEffectStates
from rigwatch.physics.engine.fit.recording import Recording, cut_for, initial_states, shown_states
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import ModelError

START_STEPS = 2
"""Most simulations for the initial states per evaluation, starting from the best known ones."""

ENOUGH = 1e-3
"""Predicted reduction of a window's squared error that justifies a second one."""

BACK = 0.8
"""Share of its squared error below which a window counts as recovered."""

FOLLOWED = 4
"""Ratio of a window to its part after which hidden states of an unknown start are settled."""

STEPS = 6
"""Most simulations that fit the initial states of windows."""
SETTLED = 1e-6
"""Predicted reduction of a window's squared error below which its initial state is kept."""


REMEMBERED = 2
"""Simulations kept: a search starts where initial states were compared, and ends where it was."""


@dataclass(frozen=True, eq=False)
class Started:
    """Windows at their best initial states.

    Attributes:
        parameters: all of them, shape (n_p,).
        initial: shape (windows, states).
        error: scaled, shape (windows, k).
        slopes: by free parameters and initial states, shape (windows, k, free + states).
        came_back: whether a diverged window recovered.
    """

    parameters: FloatArray
    initial: FloatArray
    error: FloatArray
    slopes: FloatArray
    came_back: bool = False


@dataclass(frozen=True, eq=False)
class _Best:
    """The evaluation with the smallest error so far.

    Attributes:
        size: squared error, initial states projected out.
        parameters: all parameters, shape (n_p,).
        initial: initial states of the simulated windows, shape (windows, states).
    """

    size: float
    parameters: FloatArray
    initial: FloatArray


class Problem:
    """One recording divided into windows, simulated at the solver's parameters."""

    def __init__(
        self,
        compiled: CompiledSystem,
        recording: Recording,
        horizon: int,
        *,
        scale: FloatArray | None,
        substeps: int,
        initial: FloatArray | None,
        apart: bool = False,
    ) -> None:
        self.compiled, self.recording, self._substeps = compiled, recording, substeps
        system = self.system = compiled.system
        names = list(system.parameters)
        self.free = np.array([names.index(name) for name in system.free], dtype=np.int64)
        self._cut = cut_for(system, recording, horizon, apart=apart)
        rows = self._cut.starts[:, None] + np.arange(self._cut.length)
        self.measured = recording.outputs[np.minimum(rows, len(recording) - 1)]
        self._inputs, self._spacing = recording.inputs, recording.spacing
        self._begins, self._time = recording.begins, recording.time
        if self._cut.parts:
            ends = np.array(self._cut.parts)[:, None]
            self.measured[np.arange(self._cut.length) >= ends] = np.nan
            beyond = int(rows.max()) + 1 - len(recording)
            longer = self._with_last_repeated(beyond)
            self._inputs, self._spacing, self._begins, self._time = longer
        self.scale = np.nanstd(recording.outputs, axis=0) if scale is None else scale
        self.scale = np.where(self.scale > 0, self.scale, 1.0)
        begun = initial_states(system, recording)
        self.initial = begun[self._cut.starts]
        self._given_initial = initial
        self._effect_states = RecordedEffectStates(
            system,
            recording.inputs,
            begun,
            recording.time,
            recording.spacing,
            compiled.parameters,
            recording.slices,
        )
        known, counted = self._effect_states.exact, self._effect_states.counted
        self._every = np.setdiff1d(np.arange(len(system.states)), counted)
        self._unknown = np.setdiff1d(self._every, known)
        shown = shown_states(system)
        self.hidden = np.array([i for i in self._unknown if i not in shown], np.int64)
        self._told, self.unresolved, self._fastest = False, False, math.inf
        self._low, self._high = (
            np.array([getattr(state, end) for state in system.states.values()])
            for end in ("low", "high")
        )
        self._best: _Best | None = None
        self._last: tuple[bytes, tuple[FloatArray, FloatArray]] | None = None
        self._runs: dict[tuple[bytes, bytes, bytes], Simulation] = {}

    @property
    def starts(self) -> IntArray:
        """First sample of each window."""
        return self._cut.starts

    @property
    def length(self) -> int:
        """Samples of a window."""
        return self._cut.length

    @property
    def lengths(self) -> tuple[int, ...]:
        """Number of recorded samples in each window."""
        return self._cut.parts or (self._cut.length,) * len(self._cut.starts)

    @cached_property
    def first_windows(self) -> IntArray:
        """The first window of each recording, and of what follows a time of unknown inputs."""
        begins = [part.start for part in self.recording.slices] + [*self.recording.breaks]
        first = np.unique(np.searchsorted(self._cut.starts, begins))
        return np.asarray(first[first < len(self._cut.starts)], np.int64)

    @cached_property
    def later_windows(self) -> IntArray:
        """All windows but `first_windows`."""
        return np.setdiff1d(np.arange(len(self.starts)), self.first_windows)

    @cached_property
    def window_order(self) -> list[IntArray]:
        """Windows except the first of each recording: all second ones, then all third ones, …"""
        every = np.arange(len(self.starts))
        begun = np.searchsorted(self.first_windows, every, side="right") - 1
        since = every - self.first_windows[begun]
        return [np.nonzero(since == turn)[0] for turn in range(1, int(since.max()) + 1)]

    @property
    def measured_states(self) -> IntArray:
        """Columns of the unknown states that channels measure."""
        return np.setdiff1d(self._unknown, self.hidden)

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the states, each of shape (states,)."""
        return self._low, self._high

    def begin_at(self, rows: IntArray, columns: IntArray, values: FloatArray) -> None:
        """Set the initial values of some states in some windows."""
        self.initial = self.initial.copy()
        self.initial[np.ix_(rows, columns)] = values

    def resolve_rates(self, parameters: FloatArray) -> None:
        """From now on keep the model's modes as slow as the recording resolves.

        Those of a model that is faster at these parameters become no faster.
        """
        self.unresolved = False
        self._fastest = rate_limit(self.compiled, parameters, self.recording.dt)

    def hold(self, initial: FloatArray, columns: IntArray) -> None:
        """Set the initial states of windows and fix some of the states."""
        self.initial = initial.copy()
        self._unknown = np.setdiff1d(self._unknown, columns)
        self._told = True

    def whole(self, begin: FloatArray, theta: FloatArray) -> FloatArray:
        """All parameters, with the free ones replaced."""
        parameters = begin.copy()
        parameters[self.free] = theta
        return parameters

    def recall(self, parameters: FloatArray) -> None:
        """Initialise effect states from the measured signals.

        Windows start from the channels' states or, if better, from the given ones; a recording that
        is one window and has no given ones starts, if better, from where its hidden states settle.
        """
        rows, own = np.arange(len(self.initial)), len(self.system.model.states)
        self._set_effect_states(parameters, self._effect_states.columns, rows)
        if self._given_initial is not None and len(self._given_initial) == len(self.initial):
            other = np.column_stack([self._given_initial[:, :own], self.initial[:, own:]])
        elif len(self.hidden) and len(self.first_windows) == len(rows):
            other = self._followed(parameters)
        else:
            return
        shown, offered = (
            np.sum(self.simulated(parameters, rows, each)[0] ** 2, axis=1)
            for each in (self.initial, other)
        )
        self.initial = np.where((offered < shown)[:, None], other, self.initial)

    def _followed(self, parameters: FloatArray) -> FloatArray:
        """Initial states, hidden ones as they are after a part of each window; (windows, states).

        They forget their values in the model's file, which may be far from those of this machine.
        """
        run = self.compiled.simulate(
            self._inputs, self._spacing, self._cut.starts,
            max(self._cut.length // FOLLOWED, 2), initial=self.initial, parameters=parameters,
            substeps=self._substeps, begins=self._begins, time=self._time,
        )  # fmt: skip
        found = self.initial.copy()
        found[:, self.hidden] = np.clip(run.last, self._low, self._high)[:, self.hidden]
        return np.where(np.isfinite(found), found, self.initial)

    def follow_inputs(self, parameters: FloatArray) -> None:
        """Initialise effect states at actuators from the inputs.

        Those of the first window of each recording are fitted: its inputs are unknown before.
        """
        self._set_effect_states(parameters, self._effect_states.exact, self.later_windows)

    def _set_effect_states(
        self, parameters: FloatArray, columns: list[int], rows: IntArray
    ) -> None:
        if columns and not self._cut.parts:
            states = self._effect_states.at(parameters)
            self.initial = self.initial.copy()
            for column in columns:
                self.initial[rows, column] = states[column][self._cut.starts[rows]]

    def simulated(
        self, parameters: FloatArray, rows: IntArray, initial: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Scaled residuals (rows, k), slopes (rows, k, free + states); 0 if unmeasured."""
        run = self._run(parameters, rows, initial)
        return self._scaled(run.outputs, run.slopes, rows)

    def simulated_to_next(
        self, parameters: FloatArray, rows: IntArray, initial: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """`simulated`, and the states at the first sample after each window with their slopes.

        Returns:
            Scaled residuals and slopes; states (rows, states), slopes (rows, states, free +
            states).
        """
        inputs, spacing, begins, time = self._and_next
        run = self.compiled.simulate(
            inputs, spacing, self._cut.starts[rows], self._cut.length + 1, initial=initial,
            parameters=parameters, substeps=self._substeps, begins=begins, time=time,
        )  # fmt: skip
        error, slopes = self._scaled(run.outputs[:, :-1], run.slopes[:, :-1], rows)
        return error, slopes, run.last, run.last_slopes

    @cached_property
    def _and_next(self) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
        """`_with_last_repeated`, once: the last window has a next sample."""
        return self._with_last_repeated(1)

    def _with_last_repeated(
        self, samples: int
    ) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
        """Inputs, spacing, begins and time; the last sample is repeated, while time goes on."""
        inputs = np.pad(self._inputs, ((0, samples), (0, 0)), mode="edge")
        spacing = np.pad(self._spacing, (0, samples), mode="edge")
        begins = np.pad(self._begins, (0, samples), mode="edge")
        beyond = self._time[-1] + self._spacing[-1] * np.arange(1, samples + 1)
        return inputs, spacing, begins, np.concatenate([self._time, beyond])

    def _scaled(
        self, outputs: FloatArray, slopes: FloatArray, rows: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Scaled residuals (rows, k) and slopes (rows, k, …) of simulated windows."""
        error = (self.measured[rows] - outputs) / self.scale
        slopes = slopes / self.scale[:, None]
        missing = np.isnan(self.measured[rows])
        if missing.any():
            error, slopes = np.where(missing, 0.0, error), np.where(missing[..., None], 0.0, slopes)
        error, slopes = self._thinned(error, rows), self._thinned(slopes, rows)
        flat = error.reshape(len(error), -1)
        return flat, slopes.reshape(*flat.shape, slopes.shape[-1])

    def _run(self, parameters: FloatArray, rows: IntArray, initial: FloatArray) -> Simulation:
        """A simulation, one of the last `REMEMBERED` if it was made before."""
        key = (parameters.tobytes(), rows.tobytes(), initial.tobytes())
        if key in self._runs:
            return self._runs[key]
        run = self.compiled.simulate(
            self._inputs, self._spacing, self._cut.starts[rows], self._cut.length,
            initial=initial, parameters=parameters, substeps=self._substeps, begins=self._begins,
            time=self._time,
        )  # fmt: skip
        while len(self._runs) >= REMEMBERED:
            del self._runs[next(iter(self._runs))]
        self._runs[key] = run
        return run

    def _thinned(self, signals: FloatArray, rows: IntArray) -> FloatArray:
        """Values filtered and decimated as the recording requires, per recording if windows are."""
        thinning = self.recording.thinning
        if thinning is None:
            return signals
        if not self._cut.parts:
            return thinning.apply(signals)
        found = np.zeros((len(rows), max(self._lengths), *signals.shape[2:]))
        for at, row in enumerate(rows):
            length = self._cut.parts[row]
            alone = thinning.of_part(length)
            found[at, : self._lengths[row]] = alone.apply(signals[at : at + 1, :length])[0]
        return found

    @cached_property
    def _lengths(self) -> tuple[int, ...]:
        """Number of counted samples of each recording, if windows are recordings."""
        thinning, parts = self.recording.thinning, self._cut.parts
        if thinning is None:
            return parts
        alone = [thinning.of_part(n).apply(np.zeros((1, n, 1))) for n in parts]
        return tuple(each.shape[1] for each in alone)

    def _where(self, window: int) -> str:
        """Which part of the recordings a window is, in words."""
        first, recording = self._cut.starts[window], self.recording
        number = int(np.searchsorted([part.start for part in recording.slices], first, "right"))
        since = first - recording.slices[number - 1].start
        dt = recording.own_spacings[number - 1]
        of = f" of recording {number}" if len(recording.slices) > 1 else ""
        return f"from {since * dt:.4g} to {(since + self._cut.length) * dt:.4g} s{of}"

    def whole_recording(self, windowed: FloatArray) -> FloatArray:
        """Values of all windows, (windows, samples, …), in the layout of `Fit`."""
        return self._cut.whole(windowed, self._lengths)

    def start_windows(self, parameters: FloatArray, steps: int = STEPS) -> Started:
        """Settle, and begin windows also where the previous one ends; the better start is kept.

        Initial states have local minima of their own.

        Args:
            parameters: all parameters, shape (n_p,).
            steps: most simulations.
        """
        if self._best is not None and np.array_equal(self._best.parameters, parameters):
            self.initial = self._best.initial
        error, slopes = self.settle(parameters, steps)
        found, rows = Started(parameters, self.initial, error, slopes), _later(error)
        if not (self.system.states and len(rows)) or self._cut.parts:
            return found
        self.initial = self.initial.copy()
        self.initial[rows] = self.ends_before(parameters, rows)
        try:
            again, again_slopes = self.settle(parameters, rows=rows)
        except ModelError:
            self.initial = found.initial
            return found
        back = np.sum(again**2, axis=1) < BACK * np.sum(error[rows] ** 2, axis=1)
        error[rows[back]], slopes[rows[back]] = again[back], again_slopes[back]
        self.initial[rows[~back]] = found.initial[rows[~back]]
        self._best = self._last = None
        return Started(parameters, self.initial, error, slopes, bool(back.any()))

    def ends_before(self, parameters: FloatArray, rows: IntArray) -> FloatArray:
        """Final states of the windows preceding `rows`, shape (rows, states)."""
        before = rows - 1
        run = self.compiled.simulate(
            self._inputs, self._spacing, self._cut.starts[before], self._cut.length + 1,
            initial=self.initial[before], parameters=parameters, substeps=self._substeps,
            begins=self._begins, time=self._time,
        )  # fmt: skip
        ended = np.clip(run.last, self._low, self._high)
        return np.where(np.isfinite(ended), ended, self.initial[rows])

    def settle(
        self,
        parameters: FloatArray,
        steps: int = STEPS,
        *,
        least_reduction: float = SETTLED,
        rows: IntArray | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Fit the initial states; return scaled residuals and slopes there.

        Each window takes its own Gauss-Newton steps until they no longer help. A step that
        increases the error, as one that leaves the play of a valve does, is repeated without what
        the samples leave open, then with a quarter of its length.

        Args:
            parameters: all parameters, shape (n_p,).
            steps: most simulations.
            least_reduction: smallest predicted relative reduction of a window's squared error for
                a step.
            rows: windows to settle, all if None.
        """
        self.follow_inputs(parameters)
        rows = np.arange(len(self.initial)) if rows is None else rows
        best = self.initial[rows]
        error, slopes = self.simulated(parameters, rows, best)
        if not (np.isfinite(slopes).all() and np.isfinite(error).all()):
            finite = np.isfinite(error).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2))
            raise ModelError(
                f"{self.system.model.name}: the simulation diverged (NaN or infinite)"
                f" {self._where(rows[~finite][0])}; expected equations that stay finite there,"
                " other values under [start] or more `substeps`"
            )
        if not self.system.states:
            return error, slopes
        step, reduced = self._steps(error, slopes, rows), np.zeros(len(rows), np.bool_)
        for further in reversed(range(steps - 1)):
            size = np.sum(error**2, axis=1)
            (moving,) = np.nonzero(self.predicted_reduction(step, slopes) > least_reduction * size)
            if not len(moving):
                break
            there = np.clip(best[moving] + step[moving], self._low, self._high)
            tried, tried_slopes = self.simulated(parameters, rows[moving], there)
            usable = np.isfinite(tried_slopes).all(axis=tuple(range(1, tried_slopes.ndim)))
            better = (np.sum(tried**2, axis=1) < size[moving]) & usable
            improved = moving[better]
            best[improved], error[improved], slopes[improved] = (
                there[better],
                tried[better],
                tried_slopes[better],
            )
            if further:
                step[improved] = self._steps(error[improved], slopes[improved], rows[improved])
                failed, reduced[improved] = moving[~better], False
                step[failed[reduced[failed]]] /= 4
                first = failed[~reduced[failed]]
                step[first] = self._determined_steps(error[first], slopes[first], best[first])
                reduced[first] = True
        self.initial = self.initial.copy()
        self.initial[rows] = best
        return error, slopes

    def predicted_reduction(self, step: FloatArray, slopes: FloatArray) -> FloatArray:
        """Predicted reduction of each window's squared error by a step, to first order."""
        moved = slopes[..., len(self.free) :] @ step[..., None]
        return np.asarray(np.sum(moved[..., 0] ** 2, axis=1))

    def _steps(self, error: FloatArray, slopes: FloatArray, rows: IntArray) -> FloatArray:
        """Gauss-Newton step of each window's initial state, shape (rows, states)."""
        return np.asarray(self._tangent(slopes, rows).solve(error[..., None])[..., 0])

    def _determined_steps(
        self, error: FloatArray, slopes: FloatArray, initial: FloatArray
    ) -> FloatArray:
        """Steps along what the samples determine of initial states, shape (rows, states).

        Of a fast state little is left in the first sample that counts. A step along it may be many
        times its size, where nothing is linear, and hide what a slow state would explain. A
        direction is left out if a change by the states' own sizes changes the squared error by less
        than one: by less than noise does.
        """
        size = np.where(initial == 0.0, 1.0, np.abs(initial))
        known = np.zeros(initial.shape[1])
        known[self._unknown] = 1.0
        own = slopes[..., len(self.free) :] * (size * known)[:, None, :]
        basis, sizes, turn = np.linalg.svd(own, full_matrices=False)
        inverse = np.where(sizes >= 1.0, 1.0 / np.maximum(sizes, 1.0), 0.0)
        along = np.einsum("wks,wk->ws", basis, error) * inverse
        return np.asarray(size * known * np.einsum("wsj,ws->wj", turn, along))

    def _tangent(self, slopes: FloatArray, rows: IntArray) -> Tangent:
        """Projection of the unknown initial states; input-driven states are known later on."""
        if self._told or len(self._unknown) == len(self._every):
            groups = [(np.arange(len(rows)), self._unknown)]
        else:
            first = np.isin(rows, self.first_windows)
            groups = [
                (np.nonzero(first)[0], self._every),
                (np.nonzero(~first)[0], self._unknown),
            ]
        return Tangent(slopes[..., len(self.free) :], groups)

    def projected(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and Jacobian by the free parameters, initial states projected out."""
        key = parameters.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, self._project(parameters))
        return self._last[1]

    def tried(self, parameters: FloatArray) -> FloatArray:
        """Residuals for the solver; NaN if the simulation diverges, and the solver steps back.

        The same where a mode becomes too fast for the recording to resolve.
        """
        if self.compiled.fastest(parameters) > self._fastest:
            self.unresolved = True
            return np.full(self.count, np.nan)
        before = self.initial
        try:
            return self.projected(parameters)[0]
        except ModelError:
            self.initial = before
            return np.full(self.count, np.nan)

    @property
    def count(self) -> int:
        """Number of residuals of the solver."""
        shape = (self.measured.shape[0], self.measured.shape[1], 1)
        thinned = self._thinned(np.zeros(shape), np.arange(shape[0])).shape
        return math.prod(thinned) * int(self.measured.shape[2])

    def _project(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self._best is not None:
            self.initial = self._best.initial
        found = self.cleaned(*self.settle(parameters, START_STEPS, least_reduction=ENOUGH))
        size = float(found[0] @ found[0])
        if self._best is None or size < self._best.size:
            self._best = _Best(size, parameters.copy(), self.initial)
        return found

    def tangent(self, slopes: FloatArray) -> Tangent:
        """The influence of the initial states of all windows; `slopes` as in `Started`."""
        return self._tangent(slopes, np.arange(len(slopes)))

    def cleaned(
        self, error: FloatArray, slopes: FloatArray, tangent: Tangent | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Residual and Jacobian with the influence of the initial states projected out."""
        m, tangent = len(self.free), tangent or self.tangent(slopes)
        both = tangent.without(np.concatenate([error[..., None], slopes[..., :m]], axis=-1))
        return -both[..., 0].ravel(), both[..., 1:].reshape(error.size, m)

    @cached_property
    def measured_count(self) -> float:
        """Residuals that samples determine: what is missing, or pads a recording, tells nothing.

        A decimated residual mixes samples; as many of them count as of the samples that they mix.
        """
        known, outputs = float(np.sum(np.isfinite(self.measured))), self.measured.shape[2]
        if self.recording.thinning is None:
            return known
        kept = sum(self._lengths) * outputs if self._cut.parts else self.count
        return float(known / (sum(self.lengths) * outputs) * kept)


def _later(error: FloatArray) -> IntArray:
    """Windows, except the first, in which something is left."""
    return np.nonzero(np.sum(error[1:] ** 2, axis=1) > 0.0)[0] + 1

"""Influence of a missing effect on the outputs, to first order in its strength.

Along the trajectory of a fitted model an effect at strength zero adds e(t) = ∂effect/∂strength to
its port. The outputs then change by

    dR/dt = (∂f/∂x)·R + (∂f/∂port)·e,   ∂y/∂strength = (∂g/∂x)·R + (∂g/∂port)·e,   R(0) = 0

which is one linear equation for all candidates and needs no further compilation for the model. At a
sensor the effect changes only its own output. Where the model returns to rest faster than the steps
resolve, as a tank that is nearly empty does, they are implicit: explicit ones would grow there.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from rigwatch.physics.engine.compile import (
    Linearisation,
    derivative,
    numpy_function,
    on_all_cores,
    shares,
)
from rigwatch.physics.engine.equations import PROBE, System, hold_at, parse, symbol
from rigwatch.physics.engine.score.candidates import Candidate, root_mean_square
from rigwatch.physics.engine.score.trajectory import Trajectory, memory, port_signals, presence
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.kernel import kernel

STABLE = 2.0
"""Rate times step up to which a decay stays one in Heun's method."""


def directions(at: Trajectory, candidates: Sequence[Candidate]) -> FloatArray:
    """∂outputs/∂strength of every candidate, shape (windows, samples, outputs, candidates)."""
    system, run = at.compiled.system, at.run
    kinds = {name: port.kind for name, port in system.model.ports.items()}
    inner = [c for c in candidates if kinds[c.port] != "sensor"]
    seen = {port: port_signals(at, port) for port in {c.port for c in candidates}}
    found = np.zeros((*run.outputs.shape, len(candidates)))
    if inner:
        pushes = _pushes(at, inner, seen)
        columns = np.array([_probe_column(system, c.port) for c in inner])
        places = [i for i, c in enumerate(candidates) if kinds[c.port] != "sensor"]
        held = np.array(
            [hold_at(system.model, system.model.ports[c.port]) == "zero" for c in inner]
        )
        found[..., places] = _propagated(run, len(system.free), pushes, columns, held)
    outer = [i for i, c in enumerate(candidates) if kinds[c.port] == "sensor"]
    pushes = _pushes(at, [candidates[index] for index in outer], seen) * presence(at)
    for index, push in zip(outer, pushes, strict=True):
        signal = list(system.outputs).index(system.model.ports[candidates[index].port].signal)
        found[..., signal, index] = push[:, :: run.substeps]
    return found


def _pushes(
    at: Trajectory, candidates: Sequence[Candidate], seen: Mapping[str, dict[str, FloatArray]]
) -> FloatArray:
    """e(t) of candidates at the nodes, shape (candidates, windows, nodes).

    `seen` holds the signals at each port.
    """
    found = np.empty((len(candidates), *at.time.shape))
    # Only numbers are left to the threads.
    ready = [_ready(at, each, seen[each.port]) for each in candidates]

    def fill(index: int) -> None:
        found[index] = ready[index]()

    on_all_cores(fill, range(len(candidates)))
    return found


def _probe_column(system: System, port: str) -> int:
    return len(system.free) + len(system.states) + system.probes.index(PROBE + port)


def _ready(
    at: Trajectory, candidate: Candidate, signals: dict[str, FloatArray]
) -> Callable[[], Any]:
    """A function that returns e(t) of one candidate at the nodes, of shape (windows, nodes)."""
    names = {name: symbol(name) for name in (*signals, *candidate.effect.states)}
    names |= {name: symbol(name) for name in candidate.effect.parameters}
    effect, values = candidate.effect, _neutral_values(candidate)
    text = (effect.expression, effect.direction, effect.strength)
    function, used = _push_function(*text, tuple(names))
    states = memory(at, candidate, signals) if used & set(effect.states) else None

    def pushed() -> Any:
        remembered = states(values) if states else {}
        known = {**dict.fromkeys(names, 0.0), **signals, **remembered, **values}
        return function(*(known[name] for name in names))

    return pushed


@cache
def _push_function(
    expression: str, direction: str, strength: str, names: tuple[str, ...]
) -> tuple[Callable[..., Any], frozenset[str]]:
    """∂effect/∂strength as a function of all available names, and the names it uses."""
    symbols = {name: symbol(name) for name in names}
    if direction:
        found = parse(direction, symbols, "direction")
    else:
        found = derivative(parse(expression, symbols, "effect"), symbols[strength])
    used = frozenset(s.name for s in found.free_symbols)
    return numpy_function(names, found), used


def _neutral_values(candidate: Candidate) -> dict[str, float]:
    strength = candidate.effect.strength
    neutral = candidate.effect.parameters[strength].neutral
    return {**candidate.shape, strength: neutral}


def _propagated(
    run: Linearisation, free: int, pushes: FloatArray, columns: IntArray, held: BoolArray
) -> FloatArray:
    """Change of outputs by pushes at probes, shape (windows, samples, outputs, candidates).

    `pushes` has shape (candidates, windows, nodes), `columns` and `held` (candidates,). A `held`
    push changes only at samples: up to there it keeps its value of the previous node.
    """
    if run.states.shape[2] == 0:
        direct = run.read_slopes[..., columns]
        return np.asarray(direct * np.moveaxis(pushes[..., :: run.substeps], 0, -1)[:, :, None])
    moved = np.empty((len(columns), *run.outputs.shape))
    slopes = run.rate_slopes, run.read_slopes, run.update_slopes
    stiff, inverses = _implicit_steps(run, free)

    def propagate(c: slice) -> None:
        _propagate(
            *slopes, free, columns[c], held[c], pushes[c], run.spacing, run.substeps, stiff,
            inverses, moved[c],
        )  # fmt: skip

    on_all_cores(propagate, shares(len(columns)))
    return np.moveaxis(moved, 0, -1)


def _implicit_steps(run: Linearisation, free: int) -> tuple[IntArray, FloatArray]:
    """The steps in which Heun's method would grow what decays, and their implicit Euler steps.

    Returns:
        Place of each step among the implicit ones, -1 for Heun's, shape (windows, nodes - 1);
        (1 - h·∂f/∂x)⁻¹ at their ends, shape (steps, n, n).
    """
    n, h = run.states.shape[2], run.spacing[..., None, None]
    sizes = np.array([root_mean_square(own) for own in np.moveaxis(run.states, 2, 0)])
    # In units of the states' sizes, so that no eigenvalues are needed where nothing is stiff.
    scaled = h * run.rate_slopes[..., free : free + n] * sizes / sizes[:, None]
    stiff = np.linalg.norm(scaled, axis=(2, 3)) > STABLE
    stiff &= np.isfinite(scaled).all(axis=(2, 3))
    rates = np.linalg.eigvals(scaled[stiff])
    stiff[stiff] = ((np.abs(rates) > STABLE) & (rates.real < 0)).any(axis=1)
    steps = stiff[:, :-1] | stiff[:, 1:]
    place = np.where(steps, np.cumsum(steps).reshape(steps.shape) - 1, -1)
    ends = (h[:, :-1] * run.rate_slopes[:, 1:, :, free : free + n])[steps]
    return place, np.linalg.inv(np.eye(n) - ends)


@kernel(allocates=True, nogil=True)
def _propagate(  # noqa: C901, PLR0912, PLR0917 -- a kernel
    rates: FloatArray, reads: FloatArray, updates: FloatArray, free: int, columns: IntArray,
    held: BoolArray, pushes: FloatArray, spacing: FloatArray, substeps: int, stiff: IntArray,
    inverses: FloatArray, moved: FloatArray,
) -> None:  # fmt: skip
    """Heun's method over the nodes, candidate by candidate; the outputs are read at the samples.

    The last axis of the slopes is (free parameters, states, probes). `stiff` and `inverses` are
    those of `_implicit_steps`.
    """
    candidates, windows, nodes = pushes.shape
    n = rates.shape[2]
    response, ahead = np.empty(n), np.empty(n)
    slope, next_slope = np.empty(n), np.empty(n)
    for c in range(candidates):
        column = columns[c]
        for w in range(windows):
            for i in range(n):
                response[i] = 0.0
            for node in range(nodes):
                push = pushes[c, w, node]
                if node % substeps == 0:
                    k = node // substeps
                    if updates.shape[1] > 0 and k > 0:
                        _slopes(updates[w, k], free, column, push, response, ahead)
                        for i in range(n):
                            response[i] = ahead[i]
                    for o in range(moved.shape[3]):
                        value = reads[w, k, o, column] * push
                        for j in range(n):
                            value += reads[w, k, o, free + j] * response[j]
                        moved[c, w, k, o] = value
                if node + 1 < nodes:
                    h, following = spacing[w, node], node + 1
                    jumps = held[c] and following % substeps == 0
                    ending = push if jumps else pushes[c, w, following]
                    if stiff[w, node] >= 0:
                        for i in range(n):
                            ahead[i] = response[i] + h * rates[w, following, i, column] * ending
                        _multiply(inverses[stiff[w, node]], ahead, response)
                        continue
                    _slopes(rates[w, node], free, column, push, response, slope)
                    for i in range(n):
                        ahead[i] = response[i] + h * slope[i]
                    _slopes(rates[w, following], free, column, ending, ahead, next_slope)
                    for i in range(n):
                        response[i] += 0.5 * h * (slope[i] + next_slope[i])


@kernel(nogil=True)
def _slopes(  # noqa: PLR0917 -- a kernel
    by: FloatArray, free: int, column: int, push: float, at: FloatArray, out: FloatArray
) -> None:
    for i in range(at.size):
        value = by[i, column] * push
        for j in range(at.size):
            value += by[i, free + j] * at[j]
        out[i] = value


@kernel(nogil=True)
def _multiply(matrix: FloatArray, by: FloatArray, out: FloatArray) -> None:
    for i in range(out.size):
        value = 0.0
        for j in range(by.size):
            value += matrix[i, j] * by[j]
        out[i] = value

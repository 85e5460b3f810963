"""Initial values of a fit without simulation: the equations balanced along the measured motion.

If channels measure all states of a model, every equation with a free parameter is a balance of
measured signals: an acceleration output, or the rate of a velocity. Multiplied by their common
denominator most are linear in the parameters (m·a = F − k·x − c·v), so bounded least squares needs
no initial values. The others are solved by bounded Gauss-Newton steps from several starts. Both are
cheap, as nothing is integrated. This is the classical equation-error method (L. Ljung, System
Identification, 1999, 7.3). Noise of the motion biases it, so it only provides initial values.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
import sympy
from scipy.optimize import least_squares, lsq_linear

from rigwatch.physics.engine.compile import CompiledSystem, derivative, numpy_function
from rigwatch.physics.engine.equations import TIME, UNTIL, System, symbol
from rigwatch.physics.engine.fit import (
    RecordedEffectStates,
    Recording,
    bounds,
    filled,
    initial_states,
)
from rigwatch.wire.arrays import BoolArray, FloatArray

TARGET = "target_"
WIDTHS = (7, 15, 41)
"""Smoothing widths of the motion [samples]; the best depends on noise and speed."""
MOST = 3000
"""Most samples used in a balance, evenly spaced."""
REWEIGHTED = 3
"""Number of reweightings of the equations by their residuals."""
STEPS = 60
"""Most evaluations of the nonlinear balance."""


@dataclass(frozen=True, eq=False)
class Balance:
    """One equation that should vanish along the measured motion.

    Attributes:
        name: of the output or state.
        left: target minus expression.
        columns, rest: the same times its denominator, as Σ columns·parameters + rest; no columns
            if that is not linear in the parameters.
        target: measured values, shape (n,); NaN without a valid sample.
        rate: whether the target is the rate of change of a state.
    """

    name: str
    left: sympy.Expr
    columns: tuple[sympy.Expr, ...]
    rest: sympy.Expr
    target: FloatArray
    rate: bool


def equation_error_starts(
    compiled: CompiledSystem, recording: Recording, begin: FloatArray
) -> list[FloatArray]:
    """Parameters that balance the equations, one vector per smoothing width.

    Args:
        compiled: the system.
        recording: the recording to fit.
        begin: all parameters, shape (n_p,); the fixed ones are kept.

    Returns:
        Vectors of shape (n_p,); none if a state of the model is not measured.
    """
    system = compiled.system
    if not system.free or not system.model.states or not _shown(system):
        return []
    with np.errstate(all="ignore"):
        found = [_solved(system, recording, begin, width) for width in WIDTHS]
    return [vector for vector in found if vector is not None and np.isfinite(vector).all()]


def _shown(system: System) -> bool:
    """Whether every state of the model is measured."""
    channels = {output.channel or name for name, output in system.model.outputs.items()}
    return all(
        state.measured in channels or state.rate_of in channels
        for state in system.model.states.values()
    )


def _solved(
    system: System, recording: Recording, begin: FloatArray, width: int
) -> FloatArray | None:
    if len(recording) <= 2 * width:
        return None
    balances = _balances(system, recording, width)
    if not balances:
        return None
    signals = _signals(system, recording, begin, width)
    start = begin
    try:
        if all(balance.columns for balance in balances):
            start = _linear(system, balances, signals, begin)
        return _nonlinear(system, balances, signals, start)
    except (ValueError, np.linalg.LinAlgError):
        # Signals that overflow when squared cannot be balanced.
        return None


def _balances(system: System, recording: Recording, width: int) -> list[Balance]:
    """Outputs and rates of change that contain free parameters."""
    outputs = system.model.outputs
    channels = {o.channel or name: j for j, (name, o) in enumerate(outputs.items())}
    found = []
    for j, (name, expression) in enumerate(system.outputs.items()):
        if _has(expression, system.free):
            found.append(_balance(system, name, expression, recording.outputs[:, j], rate=False))
    for name, state in system.model.states.items():
        order = 1 if state.measured in channels else 2
        channel = state.measured if order == 1 else state.rate_of
        if channel in channels and _has(system.derivatives[name], system.free):
            signal = recording.outputs[:, channels[channel]]
            target = _smooth(signal, recording, width, order)
            found.append(_balance(system, name, system.derivatives[name], target, rate=True))
    inner = _inner(recording)
    found = [replace(each, target=np.where(inner, each.target, np.nan)) for each in found]
    return [each for each in found if np.any(np.isfinite(each.target))]


def _inner(recording: Recording) -> BoolArray:
    """Samples not next to a recording's ends, where smoothed rates are poor."""
    edge, inner = max(WIDTHS), np.zeros(len(recording), bool)
    for part in recording.slices:
        inner[part.start + edge : part.stop - edge] = True
    return inner


def _has(expression: sympy.Expr, names: Sequence[str]) -> bool:
    return bool(expression.free_symbols & {symbol(name) for name in names})


def _smooth(signal: FloatArray, recording: Recording, width: int, order: int) -> FloatArray:
    """A derivative of a signal; NaN next to gaps."""
    made = np.full(len(signal), np.nan)
    for part, dt in zip(recording.slices, recording.own_spacings, strict=True):
        if part.stop - part.start > 2 * width:
            whole = filled(signal[part])
            made[part] = scipy.signal.savgol_filter(whole, width, 3, deriv=order, delta=dt)
    gaps = np.convolve(~np.isfinite(signal), np.ones(width), "same") > 0.5
    return np.where(gaps, np.nan, made)


def _balance(
    system: System, name: str, expression: sympy.Expr, target: FloatArray, *, rate: bool
) -> Balance:
    still = {symbol(probe): 0 for probe in system.probes} | {symbol(UNTIL): 0}
    left = symbol(TARGET) - expression.xreplace(still)
    free = [symbol(each) for each in system.free]
    numerator = sympy.fraction(sympy.together(left))[0]
    columns = tuple(derivative(numerator, p) for p in free)
    if any(column.free_symbols & set(free) for column in columns):
        return Balance(name, left, (), left, target, rate)
    rest = numerator.xreplace(dict.fromkeys(free, sympy.Integer(0)))
    return Balance(name, left, columns, rest, target, rate)


def _signals(
    system: System, recording: Recording, begin: FloatArray, width: int
) -> dict[str, FloatArray]:
    """All variables of the equations except the free parameters, along the recording."""
    states = initial_states(system, recording, width)
    inputs, spacing = recording.inputs, recording.spacing
    led = RecordedEffectStates(system, inputs, states, recording.time, spacing, begin).at(begin)
    for column, values in led.items():
        states[:, column] = values
    known: dict[str, FloatArray] = {TIME: recording.time}
    known |= dict(zip(system.states, states.T, strict=True))
    known |= dict(zip(system.model.inputs, inputs.T, strict=True))
    fixed = dict(zip(system.parameters, begin.tolist(), strict=True))
    samples = np.arange(len(inputs), dtype=np.float64)
    for name, own in system.delayed.items():
        # A held value acts until the next sample: it is centred between them.
        since = samples + 0.5 + fixed[own.parameter] / recording.dt
        known[name] = np.interp(samples, since, known[own.name])
    return known | {
        name: np.full(len(inputs), value)
        for name, value in fixed.items()
        if name not in system.free
    }


def _along(
    system: System, balance: Balance, signals: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """The signals of one balance at the valid samples, with its target.

    A smoothed rate of change is centred on the sample, at which a held input changes.
    """
    seen = dict(signals) | {TARGET: balance.target}
    for name in system.model.inputs if balance.rate else ():
        if system.model.held(name) == "zero":
            before = np.concatenate([signals[name][:1], signals[name][:-1]])
            seen[name] = 0.5 * (before + signals[name])
    good = np.flatnonzero(np.isfinite(balance.target))
    rows = good[:: max(1, len(good) // MOST)]
    return {name: signal[rows] for name, signal in seen.items()}


def _linear(
    system: System,
    balances: Sequence[Balance],
    signals: Mapping[str, FloatArray],
    begin: FloatArray,
) -> FloatArray:
    """Bounded least squares of the balances times their denominators, with equal weights."""
    free = _places(system)
    low, high = bounds(system)
    blocks, rests = [], []
    for balance in balances:
        seen = _along(system, balance, signals)
        made = numpy_function(list(seen), [*balance.columns, balance.rest])(*seen.values())
        shape = seen[TARGET].shape
        values = np.stack([np.broadcast_to(value, shape) for value in made], axis=1)
        scale = float(np.sqrt(np.mean(values[:, -1] ** 2))) or 1.0
        blocks.append(values[:, :-1] / scale)
        rests.append(-values[:, -1] / scale)
    weights = np.ones(len(blocks))
    found = begin[free]
    for _ in range(REWEIGHTED):
        matrix = np.concatenate([b * w for b, w in zip(blocks, weights, strict=True)])
        wanted = np.concatenate([r * w for r, w in zip(rests, weights, strict=True)])
        size = np.sqrt(np.sum(matrix**2, axis=0))
        size = np.where(size > 0, size, 1.0)
        found = lsq_linear(matrix / size, wanted, (low * size, high * size)).x / size
        left = [np.std(r - b @ found) for r, b in zip(rests, blocks, strict=True)]
        weights = 1 / np.maximum(np.array(left), 1e-9)
    vector = begin.copy()
    vector[free] = np.clip(found, low, high)
    return _with_delays(system, vector, begin)


def _with_delays(system: System, found: FloatArray, begin: FloatArray) -> FloatArray:
    """Parameters with the delays of held inputs, which no balance determines, as they were."""
    names = list(system.parameters)
    kept = [names.index(own.parameter) for own in system.delayed.values()]
    found[kept] = begin[kept]
    return found


def _nonlinear(
    system: System,
    balances: Sequence[Balance],
    signals: Mapping[str, FloatArray],
    start: FloatArray,
) -> FloatArray:
    """The original balances, weighted by their residuals; `start` if the solver fails."""
    free, (low, high) = _places(system), bounds(system)
    parts = []
    for balance in balances:
        seen = _along(system, balance, signals)
        names = [*seen, *system.free]
        slopes = [derivative(balance.left, symbol(name)) for name in system.free]
        function = numpy_function(names, [balance.left, *slopes])
        parts.append((function, list(seen.values()), float(np.std(seen[TARGET])) or 1.0))

    def evaluated(theta: FloatArray) -> list[FloatArray]:
        with np.errstate(all="ignore"):
            return [
                np.stack([np.broadcast_to(v, s[0].shape) for v in function(*s, *theta)]) / size
                for function, s, size in parts
            ]

    theta = np.clip(start[free], low, high)
    weights = np.ones(len(parts))
    for _ in range(REWEIGHTED):
        if not all(np.isfinite(each).all() for each in evaluated(theta)):
            return start
        theta = _moved(evaluated, theta, weights, low, high)
        left = [float(np.std(each[0])) for each in evaluated(theta)]
        weights = 1 / np.maximum(np.array(left), 1e-9)
    vector = start.copy()
    vector[free] = theta
    return vector


def _moved(
    evaluated: Callable[[FloatArray], list[FloatArray]],
    theta: FloatArray,
    weights: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    unit = np.maximum(np.abs(theta), 1e-9)

    def error(moved: FloatArray) -> FloatArray:
        found = evaluated(np.clip(unit * moved, low, high))
        return np.concatenate([w * each[0] for w, each in zip(weights, found, strict=True)])

    def slopes(moved: FloatArray) -> FloatArray:
        found = evaluated(np.clip(unit * moved, low, high))
        return (
            np.concatenate([w * each[1:].T for w, each in zip(weights, found, strict=True)]) * unit
        )

    try:
        found = least_squares(
            error, theta / unit, jac=slopes, bounds=(low / unit, high / unit), x_scale="jac",
            max_nfev=STEPS,
        )  # fmt: skip
    except ValueError:
        return theta
    return np.asarray(np.clip(unit * found.x, low, high), np.float64)


def _places(system: System) -> FloatArray:
    names = list(system.parameters)
    return np.array([names.index(name) for name in system.free], np.int64)

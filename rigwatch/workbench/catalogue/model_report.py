"""Checks a model file: units, unused names, unobservable states, effects at its ports.

Observability is computed from one run with exact sensitivities: the derivatives of the outputs by
the initial states, over the settling time of the slowest state. A state whose column vanishes is
unobservable; states with linearly dependent columns cannot be distinguished (R. Hermann,
A. J. Krener, IEEE TAC 22(5), 1977; here numerically, along one run).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy
from scipy.linalg import matrix_balance

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import (
    Model,
    Output,
    System,
    check_model,
    measured_states,
    names_in,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import unit_of
from rigwatch.workbench.catalogue.effect_curves import Curve
from rigwatch.workbench.catalogue.port_report import entering, unread

STEPS = (1.0, 0.1, 0.01, 0.0)
"""Sizes of the inputs that are not given, in their units as the file shows them; the first with
which the run stays finite is used. A temperature begins where the model's own does."""
ROOM = 293.15
"""Temperature of an input [K] where no state has one given."""
MOST, FINEST, SETTLED = 4000, 20.0, 5.0
"""Most samples of a run, samples per fastest time constant, slowest time constants per run."""
SHOWN = 1e-9
"""Derivative by a state, relative to the largest, below which it is unobservable."""
GROWS = 1e-4
"""Rate of growth, over the fastest rate, from which a state moves away by itself."""
TAKES_PART = 0.1
"""Share of a growing motion from which a state is named."""
DISTINGUISHABLE = 1e-7
"""Singular value, relative to the largest, above which states are distinguishable."""


@dataclass(frozen=True, eq=False)
class ModelReport:
    """Result of the check.

    Attributes:
        unused: parameters, quantities and inputs that no equation uses, by name.
        unseen: states that no output shows.
        tied: states that the outputs cannot distinguish.
        growing: states that move away from the file's starting values by themselves.
        start: states that no channel measures, which start at the file's values.
        absolute: parameters in degC or degF that multiply something, as only a difference would.
        unbounded: fixed parameters without `low` and `high`, so that any value is taken.
        entering: number of effects of the library that suit each port, by its name.
        unread: variables of ports that no effect of the library uses, as "port.variable".
        inputs: value of each input during the run, in the unit in which it is shown.
        run: the outputs from the file's initial state with these inputs; none without states.
        trouble: why the run failed.
    """

    unused: tuple[str, ...]
    unseen: tuple[str, ...]
    tied: tuple[str, ...]
    growing: tuple[str, ...]
    start: tuple[str, ...]
    absolute: tuple[str, ...]
    unbounded: tuple[str, ...]
    entering: Mapping[str, int]
    unread: tuple[str, ...]
    inputs: Mapping[str, float]
    run: tuple[Curve, ...]
    trouble: str = ""

    @property
    def fine(self) -> bool:
        """Whether nothing prevents a fit."""
        return not (self.unused or self.tied or self.trouble)


def model_report(model: Model, inputs: Mapping[str, float], where: str = "") -> ModelReport:
    """Check a model.

    Args:
        model: the model.
        inputs: values of some inputs during the run, by name, in the units in which they are shown.
        where: its file, for errors.

    Raises:
        ModelError: the model cannot be used, or an input is unknown.
    """
    system = check_model(model, where)
    if unknown := set(inputs) - set(model.inputs):
        known = ", ".join(model.inputs)
        raise ModelError(f"{where}: found input {min(unknown)!r}, expected one of {known}")
    shown = {state.name for state in measured_states(model)}
    start = tuple(name for name in model.states if name not in shown)
    told = ModelReport(
        unused=_unused(model, system),
        unseen=(),
        tied=(),
        growing=(),
        start=start,
        absolute=_absolute_factors(model, system),
        unbounded=_unbounded(model),
        entering=entering(model),
        unread=unread(model),
        inputs={},
        run=(),
    )
    if not model.states:
        return told
    for step in STEPS:
        given = dict.fromkeys(model.inputs, step) | _temperatures(model) | dict(inputs)
        in_si = {n: _in_si(model, n, at) for n, at in given.items()}
        time, outputs, slopes, by_states = _run(system, in_si)
        if np.isfinite(outputs).all() and np.isfinite(slopes).all():
            break
    else:
        return replace(told, trouble=_diverged(model))
    curves = tuple(
        Curve(
            "time [s]", f"{name} [{own.shown or own.unit}]", time, _shown(own, outputs[:, column])
        )
        for column, (name, own) in enumerate(model.outputs.items())
    )
    unseen, tied = _observed(list(model.states), slopes)
    growing = _growing(list(model.states), by_states)
    return replace(told, unseen=unseen, tied=tied, growing=growing, inputs=given, run=curves)


def _diverged(model: Model) -> str:
    """That a run does not stay finite, and the states that begin at zero, in words."""
    zero = [name for name, state in model.states.items() if state.start == 0.0]
    begun = f" from {' = '.join(zero)} = 0 (`start` gives another)" if zero else ""
    more = "other starts, parameters or inputs"
    return f"the run diverged{begun}: found NaN or infinite values, expected {more}"


def inputs_of_run(model: Model, report: ModelReport) -> str:
    """The inputs of the run in words, such as "power = 1 kW"; empty without inputs or a run."""
    units = {name: own.shown or own.unit for name, own in model.inputs.items()}
    return ", ".join(f"{name} = {value:g} {units[name]}" for name, value in report.inputs.items())


def _temperatures(model: Model) -> dict[str, float]:
    """Values of the inputs that are temperatures, in the units in which they are shown.

    One kelvin is no usual temperature: surroundings at it would draw the run to where nothing is.
    """
    kelvin = unit_of("K").dimension
    own = (s.start for s in model.states.values() if unit_of(s.unit).dimension == kelvin)
    start = next((given for given in own if given > 0), ROOM)
    units = {name: unit_of(signal.shown or signal.unit) for name, signal in model.inputs.items()}
    return {name: u.from_si(start) for name, u in units.items() if u.dimension == kelvin}


def _in_si(model: Model, name: str, value: float) -> float:
    """The value of an input in SI, from the unit in which it is shown."""
    own = model.inputs[name]
    return unit_of(own.shown or own.unit).to_si(value)


def _shown(output: Output, values: FloatArray) -> FloatArray:
    """An output's values in the unit in which it is shown."""
    unit = unit_of(output.shown or output.unit)
    start, one = unit.from_si(0.0), unit.from_si(1.0)
    return values * (one - start) + start


def _unused(model: Model, system: System) -> tuple[str, ...]:
    """Names used in no equation and at no port where an effect could refer to them."""
    equations = (*system.derivatives.values(), *system.outputs.values())
    symbols = {s.name for equation in equations for s in equation.free_symbols}
    texts = [
        *(state.derivative for state in model.states.values()),
        *(output.expression for output in model.outputs.values()),
        *(v.expression for port in model.ports.values() for v in port.variables.values()),
        *(quantity.expression for quantity in model.quantities.values()),
    ]
    named = frozenset().union(*(names_in(text, "model") for text in texts))
    named |= {port.signal for port in model.ports.values() if port.kind == "actuator"}
    spelt = (v.expression for port in system.model.ports.values() for v in port.variables.values())
    symbols |= frozenset().union(*(names_in(text, "model") for text in spelt))
    leaves = [n for n in (*model.parameters, *model.inputs) if n not in symbols]
    return (*leaves, *(n for n in model.quantities if n not in named))


def _absolute_factors(model: Model, system: System) -> tuple[str, ...]:
    """Parameters given in a unit with an offset that are a factor of a product.

    0.6 degC per unit of a drive are 273.75 K: what is meant is a difference, 0.6 K.
    """
    equations = (*system.derivatives.values(), *system.outputs.values())
    factors = {
        part.name
        for equation in equations
        for product in equation.atoms(sympy.Mul)
        for part in product.args
        if part.is_Symbol and any(o.free_symbols for o in product.args if o is not part)
    }
    given = {name: unit_of(p.shown or p.unit) for name, p in model.parameters.items()}
    return tuple(n for n, unit in given.items() if n in factors and unit.from_si(0.0) != 0)


def _unbounded(model: Model) -> tuple[str, ...]:
    """Parameters whose value is given and kept within nothing."""
    given = {name: p for name, p in model.parameters.items() if p.fixed}
    return tuple(n for n, p in given.items() if math.isinf(p.low) and math.isinf(p.high))


def _run(
    system: System, inputs: Mapping[str, float]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Time (n,), outputs (n, outputs), their derivatives by initial states (n·outputs, states).

    These are free of units. And those of the states' rates by the states, (states, states), at the
    start.
    """
    compiled = compile_system(system)
    first = np.array([[state.start for state in system.states.values()]])
    values = np.array([[inputs[name] for name in system.model.inputs]])
    parameters, at = compiled.parameters, np.zeros(1, np.int64)
    there = compiled.linearise(
        np.repeat(values, 2, 0), 1e-9, at, 2, initial=first, parameters=parameters, substeps=1
    )
    free, states = len(system.free), len(system.states)
    by_states = np.nan_to_num(there.rate_slopes[0, 0, :, free : free + states])
    dt, count = _grid(np.abs(np.linalg.eigvals(by_states)))
    made = compiled.simulate(
        np.repeat(values, count, 0), dt, at, count, initial=first, parameters=parameters
    )
    slopes = _without_units(made.slopes[0, :, :, free : free + states], by_states)
    return np.arange(count, dtype=np.float64) * dt, made.outputs[0], slopes, by_states


def _without_units(slopes: FloatArray, by_states: FloatArray) -> FloatArray:
    """Derivatives of the outputs that no longer depend on the units of states and outputs.

    A pressure in Pa moves a position in m by 1e-9 times what a speed does, and is seen all the
    same. States are scaled as balancing the linear model scales them (E. E. Osborne, J. ACM 7(4),
    1960), outputs by their largest derivative.

    Args:
        slopes: shape (n, outputs, states).
        by_states: derivatives of the states' rates by the states, shape (states, states).

    Returns:
        Shape (n·outputs, states).
    """
    _, scales = matrix_balance(by_states, permute=False, separate=True)
    scaled = slopes * scales[0]
    largest = np.max(np.abs(scaled), axis=(0, 2), keepdims=True)
    return np.asarray(scaled / np.maximum(largest, 1e-300)).reshape(-1, slopes.shape[-1])


def _grid(rates: FloatArray) -> tuple[float, int]:
    """Sample period [s] and number of samples, so that the slowest state settles if possible."""
    moving = rates[rates > 1e-9 * max(float(rates.max()), 1e-300)]
    if not moving.size:
        return 0.01, 500
    fastest, slowest = float(moving.max()), float(moving.min())
    dt = min(max(1 / (FINEST * fastest), SETTLED / slowest / MOST), 1 / fastest)
    return dt, max(min(round(SETTLED / slowest / dt), MOST), 200)


def _growing(names: list[str], by_states: FloatArray) -> tuple[str, ...]:
    """States that take part in a motion of the linear model that grows."""
    balanced, _ = matrix_balance(by_states, permute=False, separate=True)
    rates, motions = np.linalg.eig(balanced)
    grows = rates.real > GROWS * max(float(np.abs(rates).max()), 1e-300)
    share = np.abs(motions[:, grows]).max(axis=1, initial=0.0)
    return tuple(name for name, own in zip(names, share.tolist(), strict=True) if own > TAKES_PART)


def _observed(names: list[str], slopes: FloatArray) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """States that no output shows, and states that cannot be distinguished."""
    size = np.linalg.norm(slopes, axis=0)
    seen = size > SHOWN * max(float(size.max()), 1e-300)
    kept = [name for name, one in zip(names, seen.tolist(), strict=True) if one]
    unit = slopes[:, seen] / size[seen]
    _, singular, axes = np.linalg.svd(unit, full_matrices=False)
    tied: set[str] = set()
    for value, axis in zip(singular.tolist(), axes, strict=True):
        if value < DISTINGUISHABLE * singular[0]:
            tied |= {n for n, part in zip(kept, np.abs(axis).tolist(), strict=True) if part > 0.1}
    unseen = tuple(name for name in names if name not in kept)
    return unseen, tuple(name for name in kept if name in tied)

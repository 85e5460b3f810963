"""Identifies the dynamics between the balance and its sensor from the motion alone.

The rate of the measured motion is the balance itself. It can therefore drive the sensor states
(those that no other equation needs) without a model of the plant. Their parameters are identified
before the plant's own, as they could otherwise bias each other.
"""

import ast
from collections.abc import Mapping, Sequence

import numpy as np
from msgspec.structs import replace
from scipy.optimize import least_squares
from scipy.signal import lfilter

from monitor.observer import high_pass
from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import (
    Input,
    Model,
    along_measured_motion,
    balanced_states,
    compose,
    names_in,
    names_reached,
    sensor_states,
    spelt_out,
)
from rigwatch.wire.arrays import FloatArray

RATE = "motion_rate"
CORNER = 0.3
"""Corner of the high-pass, below which a twice differentiated position is uninformative [Hz]."""
SETTLED = 4.0
"""Start of each recording that is skipped [s]."""
TRIES = 5
"""Decades of starts."""


def sensor_parameters(model: Model) -> frozenset[str]:
    """Parameters used only in equations of states that no other state needs."""
    model = spelt_out(model)
    needed = [(name, _reached(model, state.derivative)) for name, state in model.states.items()]
    sinks = sensor_states(model)
    elsewhere = set().union(*(used for name, used in needed if name not in sinks))
    outputs = (_reached(model, output.expression) for output in model.outputs.values())
    elsewhere |= set().union(*outputs)
    own = set().union(*(used for name, used in needed if name in sinks))
    return frozenset((own & set(model.parameters)) - elsewhere)


def fit_sensor(
    model: Model,
    recordings: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
    rate: float,
    stated: Mapping[str, float],
) -> dict[str, float]:
    """Values of the sensor's parameters that are not known; none without sensor equations.

    Args:
        model: the unmodified model.
        recordings: for each, rows of inputs and motion, measured output, and rate of the motion.
        rate: sample rate [Hz].
        stated: values that are known, in SI: the others are those of a sensor with them.
    """
    every = sensor_parameters(model)
    names = sorted(every - set(stated))
    behind = _behind_the_balance(model, every)
    if not names or behind is None:
        return {}
    compiled = compile_system(compose(behind))
    known = {name: stated[name] for name in every & set(stated)}
    start = np.array([state.start for state in behind.states.values()])[None, :]
    filters = high_pass(CORNER, rate)

    def left(logs: FloatArray) -> FloatArray:
        p = compiled.vector(known | dict(zip(names, np.exp(logs).tolist(), strict=True)))
        found = []
        for rows, measured, motion in recordings:
            inputs = np.ascontiguousarray(np.column_stack([0.0 * rows, motion]))
            made = compiled.simulate(
                inputs, 1.0 / rate, np.zeros(1, np.int64), len(rows), initial=start, parameters=p
            )
            error = np.nan_to_num(made.outputs[0, :, 0]) - measured
            found.append(lfilter(*filters, error)[round(SETTLED * rate) :])
        return np.concatenate(found)

    lows = np.log([max(model.parameters[n].low, 1e-6) for n in names])
    highs = np.log([min(model.parameters[n].high, 1e6) for n in names])
    starts = [lows + (highs - lows) * (k + 0.5) / TRIES for k in range(TRIES)]
    fits = [
        least_squares(left, begin, bounds=(lows, highs), loss="soft_l1", max_nfev=20)
        for begin in starts
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    return dict(zip(names, np.exp(best.x).tolist(), strict=True))


def _behind_the_balance(model: Model, free: frozenset[str]) -> Model | None:
    """The sensor states, driven by the rate of the motion; None if there are none."""
    model = spelt_out(model)
    along = along_measured_motion(model)
    balance = model.states[balanced_states(model)[0].name]
    names = [n for n, state in along.states.items() if free & _named(state.derivative)]
    states = {
        n: replace(
            along.states[n], derivative=_driven(along.states[n].derivative, balance.derivative)
        )
        for n in names
    }
    output = next(iter(along.outputs))
    expression = _driven(along.outputs[output].expression, balance.derivative)
    terms = _sum_of_known(expression, {RATE, *names, *free})
    if not names or RATE not in _named(terms):
        return None
    inputs = dict(along.inputs) | {RATE: Input(unit=f"({balance.unit})/s", hold="linear")}
    outputs = {output: replace(along.outputs[output], expression=terms)}
    parameters = {n: replace(p, fixed=n not in free) for n, p in along.parameters.items()}
    return replace(
        along, inputs=inputs, states=states, outputs=outputs, parameters=parameters, ports={}
    )


def _driven(text: str, balance: str) -> str:
    """An expression with the balance replaced by the rate of the motion."""
    return text.replace(f"({balance})", RATE).replace(balance, RATE)


def _sum_of_known(text: str, known: set[str]) -> str:
    """The terms of a sum that contain only known names."""
    kept = [
        f"{sign}({ast.unparse(term)})"
        for sign, term in _terms(ast.parse(text.strip(), mode="eval").body, "+")
        if _named(ast.unparse(term)) <= known
    ]
    return " ".join(kept).lstrip("+") or "0"


def _terms(node: ast.expr, sign: str) -> list[tuple[str, ast.expr]]:
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
        flipped = {"+": "-", "-": "+"}[sign] if isinstance(node.op, ast.Sub) else sign
        return [*_terms(node.left, sign), *_terms(node.right, flipped)]
    return [(sign, node)]


def _named(text: str) -> frozenset[str]:
    return names_in(text, "model")


def _reached(model: Model, text: str) -> frozenset[str]:
    return names_reached(model, text, "model")

"""Prediction along the measured motion: measured states drive the rest of a model.

A model's states are split into those measured by a channel (`measured`, `rate_of`) and hidden ones,

    x = (x_m, x_h),   dx_h/dt = f_h(t, x_m, x_h, u, p),   y = g(t, x_m, x_h, u, p)

and x_m is taken from the data. The transformed model simulates only the hidden states, with x_m
among its inputs, and predicts the outputs that are balances: an acceleration, a current, a flow. If
the hidden states converge from any initial value, no windows are needed: a whole recording is one
stable run, and the output's residual shows the missing force at every sample. This is the
series-parallel form, or teacher forcing (K. S. Narendra, K. Parthasarathy, IEEE Trans. Neural
Networks 1, 1990).

If every output is itself a measured state, the balance is predicted instead: the equation of a
measured state's rate, compared with the rate of the channel (see `measured_recording.py`),

    dv/dt = (drive - k·x - c·v + load)/m   →   output v_rate, measured as d²(position)/dt²

Two limitations. Noise of the measured motion enters as an input and biases the coefficients of v,
and of its sign near standstill. An effect at the sensor of a measured state enters the equations
wherever the state does, so the transformed model has no port for it; the workbench removes such an
effect from the recording instead.
"""

from dataclasses import dataclass

from msgspec.structs import replace

from rigwatch.physics.engine.equations.expression import names_in
from rigwatch.physics.engine.equations.model import Input, Model, Output, State
from rigwatch.physics.engine.equations.quantities import names_reached, spelt_out
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import unit_of

RATE_SUFFIX = "_rate"
"""Suffix of the output that is the balance of a state, after the state's name."""
LEVEL_SUFFIX = "_at_rest"
"""Suffix of the state at which a balance rests, after the balance's name."""


@dataclass(frozen=True)
class MeasuredState:
    """A measured state, which is an input of the transformed model.

    Attributes:
        name: of the state.
        channel: that measures it.
        order: 0 if the channel measures the state, 1 if the state is the channel's rate.
    """

    name: str
    channel: str
    order: int


def measured_states(model: Model) -> tuple[MeasuredState, ...]:
    """The states measured by channels of the model's outputs, in the model's order."""
    shown = {output.channel or name for name, output in model.outputs.items()}
    found = []
    for name, state in model.states.items():
        if state.measured in shown:
            found.append(MeasuredState(name, state.measured, 0))
        elif state.rate_of in shown:
            found.append(MeasuredState(name, state.rate_of, 1))
    return tuple(found)


def has_hidden_states(model: Model) -> bool:
    """Whether channels measure some but not all of a model's states."""
    return 0 < len(measured_states(model)) < len(model.states)


def balanced_states(model: Model) -> tuple[MeasuredState, ...]:
    """Measured states whose rate is not simply another measured state."""
    measured, states = measured_states(model), spelt_out(model).states
    names = {state.name for state in measured}
    return tuple(s for s in measured if not _named(states[s.name].derivative) <= names)


def sensor_states(model: Model) -> frozenset[str]:
    """Hidden states that none but such states need: what a sensor keeps of a signal, as its mean.

    An amplifier behind the sensor may keep something of what the sensor leaves.
    """
    spelt = spelt_out(model)
    needed = {n: names_reached(spelt, s.derivative, "model") for n, s in spelt.states.items()}
    hidden = needed.keys() - {state.name for state in measured_states(model)}
    found, before = frozenset[str](), None
    while found != before:
        before = found
        elsewhere = {n: used for n, used in needed.items() if n not in before}
        found |= {
            name
            for name in hidden
            if not any(name in used for other, used in elsewhere.items() if other != name)
        }
    return found


def predicted_outputs(model: Model) -> tuple[str, ...]:
    """Outputs that are not simply a measured state, by name; first those that measure a balance.

    A load cell may be listed before the accelerometer, which shows the same motion as the sensors
    that drive the model.
    """
    given = {state.name for state in measured_states(model)} | set(model.parameters)
    outputs, states = spelt_out(model).outputs, model.states
    found = [n for n, output in outputs.items() if not _named(output.expression) <= given]
    rates = [unit_of(f"({states[s.name].unit})/s").dimension for s in balanced_states(model)]
    return tuple(sorted(found, key=lambda n: unit_of(outputs[n].unit).dimension not in rates))


def unjudged_along_motion(model: Model) -> frozenset[str]:
    """Free parameters that outputs of a free run depend on, and none once the motion is given.

    They act on measured states alone, as a tyre's stiffness does if the travel of its suspension is
    measured.

    Args:
        model: not transformed.

    Raises:
        ModelError: no output is left to predict.
    """
    free = frozenset(name for name, parameter in model.parameters.items() if not parameter.fixed)
    return free & (_reached(spelt_out(model)) - _reached(along_measured_motion(model)))


def _reached(model: Model) -> frozenset[str]:
    """Names on which outputs depend, directly or through states."""
    outputs = model.outputs.values()
    texts = [output.expression for output in outputs]
    found = frozenset(name for o in outputs for name in (o.late, o.corner) if name)
    followed = frozenset[str]()
    while texts:
        found = found.union(*(names_reached(model, text, "model") for text in texts))
        fresh = (found - followed) & model.states.keys()
        followed |= fresh
        texts = [model.states[name].derivative for name in fresh]
    return found


def along_measured_motion(model: Model) -> Model:
    """The model with its measured states as inputs; ports and effects are unchanged.

    Raises:
        ModelError: no channel measures any of its states, or no output is left to predict.
    """
    model = spelt_out(model)
    motion = {state.name for state in measured_states(model)}
    if not motion:
        raise ModelError(
            f"{model.name}: found no measured state, expected one with `measured` or `rate_of`"
        )
    outputs = _outputs(model)
    if not outputs:
        raise ModelError(f"{model.name}: found nothing to predict once the motion is given")
    inputs = dict(model.inputs)
    inputs |= {n: Input(unit=s.unit, hold="linear") for n, s in model.states.items() if n in motion}
    states = {name: state for name, state in model.states.items() if name not in motion}
    ports = {
        name: port
        for name, port in model.ports.items()
        if port.kind != "sensor" or port.signal in outputs
    }
    return _with_unused_fixed(
        replace(model, inputs=inputs, states=states, outputs=outputs, ports=ports)
    )


def unmoved_at_rest(model: Model, *, level_known: bool = True) -> Model:
    """The model, not transformed, with balances that are zero while their motion is exactly zero.

    Whatever holds a body that sticks balances what pushes it, so that its speed does not change.
    Along a measured motion an equation of sliding friction does not know that: it leaves an
    acceleration that is not there, and hidden states that follow it, as the mean that an AC-coupled
    sensor takes away, are wrong for long after the body moves again.

    What a sensor takes away as a mean is not known of the balance either: parameters that were
    fitted to a motion without rests may leave a push in it that never moves the body. Where that
    is so, the balance rests at a level that is one more hidden state.

    Args:
        model: only balances that are a quantity of their own are found.
        level_known: whether zero is where the model's balances rest; if not, those that a sensor
            keeps the mean of rest at a constant state, the initial value of which is not known.
    """
    quantities, states = dict(model.quantities), dict(model.states)
    for state in balanced_states(model):
        name = model.states[state.name].derivative
        own = quantities.get(name)
        if own is not None and state.order == 1:
            held = f"abs(sign({state.name}))*({own.expression})"
            if not level_known and _is_averaged(model, name):
                level = f"{name}{LEVEL_SUFFIX}"
                held += f" + (1 - abs(sign({state.name})))*{level}"
                states[level] = State(unit=own.unit, derivative="0")
            quantities[name] = replace(own, expression=held)
    return replace(model, quantities=quantities, states=states)


def is_level_known(model: Model) -> bool:
    """Whether zero is where the balances of a model of `unmoved_at_rest` rest."""
    return not any(name.endswith(LEVEL_SUFFIX) for name in model.states)


def _is_averaged(model: Model, balance: str) -> bool:
    """Whether a state of a sensor follows a balance, a quantity."""
    return any(balance in _named(model.states[name].derivative) for name in sensor_states(model))


def _outputs(model: Model) -> dict[str, Output]:
    """The predicted outputs: those that remain or, if none does, the balances."""
    kept = predicted_outputs(model)
    if kept:
        return {name: model.outputs[name] for name in kept}
    states = [(balance.name, model.states[balance.name]) for balance in balanced_states(model)]
    return {
        name + RATE_SUFFIX: Output(unit=f"({state.unit})/s", expression=state.derivative)
        for name, state in states
    }


def _with_unused_fixed(model: Model) -> Model:
    """Fix the parameters that are no longer used in any equation."""
    texts = [
        *(state.derivative for state in model.states.values()),
        *(output.expression for output in model.outputs.values()),
    ]
    used = {name for text in texts for name in names_reached(model, text, "model")}
    parameters = {
        name: p if name in used else replace(p, fixed=True, kept=False)
        for name, p in model.parameters.items()
    }
    return replace(model, parameters=parameters)


def _named(text: str) -> frozenset[str]:
    return names_in(text, "model")

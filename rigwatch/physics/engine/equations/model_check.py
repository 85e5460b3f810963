"""Checks a model file as a whole: equations parse, units agree, ports are used.

A model is checked when a study opens, so that a typing error gives one line and not a verdict.
"""

import keyword

from msgspec.structs import replace

from rigwatch.physics.engine.equations.expression import FUNCTIONS, parse
from rigwatch.physics.engine.equations.model import Input, Model, Output, State
from rigwatch.physics.engine.equations.scope import symbol
from rigwatch.physics.engine.equations.system import PROBE, TIME, UNTIL, System, compose
from rigwatch.physics.engine.equations.variants import with_variants
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import times, unit_of

_TABLES = ("inputs", "states", "parameters", "quantities", "ports")


def check_model(model: Model, where: str = "") -> System:
    """Check a model and return its equations without effects.

    Args:
        model: the model.
        where: its file, for error messages.

    Raises:
        ModelError: a name is reserved or used twice, an equation does not parse or has wrong
            units, a state names an unknown channel, a parameter is out of its bounds, or a port is
            used in no equation.
    """
    try:
        _check_names(model)
        _check_channels(model)
        _check_sensors(model)
        _check_quantities(model)
        _check_per_recording(model)
        _check_bounds(model)
        system = compose(model)
    except ModelError as error:
        raise ModelError(f"{where}: {error}" if where else str(error)) from None
    unused = unused_ports(system)
    if unused:
        name = unused[0]
        kind = model.ports[name].kind
        meant = f"its signal's place taken by {name!r}" if kind == "actuator" else f"'… + {name}'"
        begin = f"{where}: " if where else ""
        raise ModelError(
            f"{begin}ports.{name}: found in no equation, so effects there would have no influence;"
            f" expected {meant} in a derivative or an output"
        )
    return system


def check_variants(model: Model, where: str = "") -> None:
    """Check the model with each variant by itself.

    Raises:
        ModelError: one is invalid; see `check_model`.
    """
    for name in model.variants:
        alone = replace(with_variants(model, (name,)), variants={})
        check_model(alone, f"{where}: variants.{name}" if where else f"variants.{name}")


def unused_ports(system: System) -> tuple[str, ...]:
    """Force and actuator ports used in no equation, by name."""
    equations = (*system.derivatives.values(), *system.outputs.values())
    used = {s for equation in equations for s in equation.free_symbols}
    return tuple(p.removeprefix(PROBE) for p in system.probes if symbol(p) not in used)


def _check_names(model: Model) -> None:
    seen: dict[str, str] = {}
    for table in _TABLES:
        for name in getattr(model, table):
            key = f"{table}.{name}"
            taken = name in FUNCTIONS or name == TIME or keyword.iskeyword(name)
            if taken or name.startswith((PROBE, UNTIL)):
                raise ModelError(
                    f"{key}: found a name that equations use for something else,"
                    f" expected another, such as {name + '_'!r}"
                )
            if not name.isidentifier():
                raise ModelError(f"{key}: found {name!r}, expected letters, digits and _")
            if name in seen:
                raise ModelError(f"{key}: found {name!r} again after {seen[name]}, expected one")
            seen[name] = key


def _check_per_recording(model: Model) -> None:
    for name, own in model.parameters.items():
        if own.per_recording and (own.fixed or own.kept):
            raise ModelError(
                f"parameters.{name}: found per_recording and {'fixed' if own.fixed else 'kept'},"
                " expected one of them"
            )


def _check_bounds(model: Model) -> None:
    for name, own in model.parameters.items():
        unit = unit_of(own.shown or own.unit)
        low, high, value = (unit.from_si(number) for number in (own.low, own.high, own.value))
        if own.low >= own.high:
            raise ModelError(
                f"parameters.{name}: found low = {low:g} and high = {high:g}, expected low below"
                " high"
            )
        if broken := own.bounds_broken(value):
            raise ModelError(
                f"parameters.{name}: found value = {own.told(own.value)}, expected {broken}"
            )


def _check_channels(model: Model) -> None:
    """Check that the channels named by states are channels of the model, in the states' units."""
    known: dict[str, Input | Output] = {**model.inputs, **model.outputs}
    known |= {own.channel: own for own in [*known.values()] if own.channel}
    for name, state in model.states.items():
        for key in ("measured", "rate_of"):
            channel = getattr(state, key)
            if channel and channel not in known:
                raise ModelError(
                    f"states.{name}.{key}: found channel {channel!r}, expected one of the model's:"
                    f" {', '.join(sorted(known))}"
                )
            if channel:
                _check_unit(f"states.{name}.{key}", state, channel, known[channel])


def _check_unit(key: str, state: State, channel: str, own: Input | Output) -> None:
    """Check that a channel can be a state, or that the state can be its rate."""
    rate = key.endswith("rate_of")
    told, has = (part.shown or part.unit for part in (own, state))
    itself = unit_of(own.unit).dimension
    its_rate = times(itself, unit_of("s").dimension, -1)
    fits, other = (its_rate, itself) if rate else (itself, its_rate)
    if unit_of(state.unit).dimension == other:
        meant = "`measured`, as the channel shows the state itself"
        if not rate:
            meant = "`rate_of`, as the state is the channel's rate of change"
        raise ModelError(
            f"{key}: found channel {channel!r} in {told} for a state in {has}, expected {meant}"
        )
    if unit_of(state.unit).dimension != fits:
        raise ModelError(
            f"{key}: found channel {channel!r} in {told} for a state in {has}, expected"
            f" {'its rate of change' if rate else 'one unit'}: convert the log's column, as with"
            f" --map '{channel}=COLUMN * FACTOR [UNIT]', or leave the key out, so that a fit"
            " estimates the state from the outputs"
        )


def _check_sensors(model: Model) -> None:
    """Check that the parameters of an output's sensor exist."""
    for name, output in model.outputs.items():
        for key in ("late", "corner"):
            named = getattr(output, key)
            if named and named not in model.parameters:
                raise ModelError(
                    f"outputs.{name}.{key}: found {named!r}, expected a parameter of the model"
                )


def _check_quantities(model: Model) -> None:
    """Check the names that quantities use; their use of ports is checked when composed."""
    ports = [name for name, port in model.ports.items() if port.kind != "sensor"]
    tables = (model.inputs, model.states, model.parameters, model.quantities, ports, [TIME])
    known = {name: symbol(name) for table in tables for name in table}
    for name, own in model.quantities.items():
        parse(own.expression, known, f"quantity {name}")

"""A model with effects at its ports: equations ready for a kernel.

Parameters and states of an effect are prefixed by its port and name, such as `load_coulomb_Fc`, so
the same effect can be at two ports. Effects at a force port are added; effects at a signal port are
applied in sequence, in the order of placement unless they are placed ahead. A model with the input
`PRESENT` has them only where that is 1, so that recordings with and without them share parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import TypeVar

import sympy
from msgspec import structs

from rigwatch.physics.engine.equations.effect import Effect
from rigwatch.physics.engine.equations.expression import names_in
from rigwatch.physics.engine.equations.model import PRESENT, Model, Parameter, Port, State
from rigwatch.physics.engine.equations.own_port import solved
from rigwatch.physics.engine.equations.quantities import hold_at, in_order, signals_at, spelt_out
from rigwatch.physics.engine.equations.scope import Scope, symbol
from rigwatch.wire.errors import ModelError

TIME = "t"
PROBE = "probe_"
RATE = "rate"
"""Name, for effects at a signal port, of the signal's rate of change."""
STEP = "step"
"""Name, for directions of effects at a signal port, of the signal's change over a sample."""
UNTIL = "until_"
LEFT = "left"
"""Name, for effects at a signal port, of the time until a held input changes; 0 otherwise.

Its symbol in a system is `UNTIL`, so a model can use the name `left` itself.
"""

T = TypeVar("T")


@dataclass(frozen=True)
class Placement:
    """The effect named `name`, at a port.

    Attributes:
        name, effect, port: the effect and its port.
        ahead: at a signal port, apply it before the effects placed there earlier.
        beyond: at a signal port, the element of the model on whose far side it acts, see
            `beyond_port`; beside the port if empty.
    """

    name: str
    effect: Effect
    port: str
    ahead: bool = False
    beyond: str = ""

    @property
    def label(self) -> str:
        """The effect and its port, as "effect@port"."""
        return f"{self.name}@{self.port}"

    @property
    def entry(self) -> str:
        """Name of the port where it enters the equations."""
        return beyond_port(self.port, self.beyond) if self.beyond else self.port

    @property
    def prefix(self) -> str:
        """Prefix of the names of its parameters and states."""
        return f"{self.port}_{self.name}_"

    def own(self, values: Mapping[str, T]) -> dict[str, T]:
        """What belongs to its parameters, by their own names.

        The name of an effect may begin with that of another, as `coulomb_by_direction` does.

        Args:
            values: by the system's names; those of other effects are left out.
        """
        named = {name: self.prefix + name for name in self.effect.parameters}
        return {name: values[whole] for name, whole in named.items() if whole in values}

    def __str__(self) -> str:
        return f"effect {self.name} at {self.port}"


@dataclass(frozen=True)
class Delayed:
    """An input that is held between samples and arrives late.

    Attributes:
        name: the input.
        parameter: by how much [s].
    """

    name: str
    parameter: str


@dataclass(frozen=True)
class System:
    """Equations of a model with its effects.

    Attributes:
        model: the model with its quantities expanded.
        placements: the effects, in order; those that delay held inputs have no states here.
        states: by name, those of the model first.
        parameters: by name, those of the model first.
        derivatives: rates of the states, by name.
        outputs: by name, as the sensors read them.
        ports: expression of each port: the added force, or the output signal.
        probes: one symbol per force or actuator port, added to its expression and always 0; the
            derivatives by them give the influence of any further effect there.
        updates: values after each sample of the sampled states, by name; their rates are 0.
        delayed: held inputs as they arrive late, by their names in the equations.
    """

    model: Model
    placements: tuple[Placement, ...]
    states: Mapping[str, State]
    parameters: Mapping[str, Parameter]
    derivatives: Mapping[str, sympy.Expr]
    outputs: Mapping[str, sympy.Expr]
    ports: Mapping[str, sympy.Expr]
    probes: tuple[str, ...]
    updates: Mapping[str, sympy.Expr] = field(default_factory=dict)
    delayed: Mapping[str, Delayed] = field(default_factory=dict)

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters."""
        return tuple(name for name, p in self.parameters.items() if not p.fixed)


def beyond_port(port: str, element: str) -> str:
    """Name of the inner port on the far side of an element that a model has at a signal port.

    A signal passes the element between both: what clips before a lag differs from what clips
    after it.
    """
    return f"{port}_beyond_{element}"


def elements_at(model: Model, port: str) -> list[str]:
    """The elements at a signal port on whose far side an effect may act, by name."""
    first = beyond_port(port, "")
    inner = (name for name, own in model.ports.items() if own.kind == "inner")
    return [name.removeprefix(first) for name in inner if name.startswith(first)]


def signal_order(placements: Sequence[Placement], port: str) -> list[Placement]:
    """The effects that enter at a port in the order in which its signal passes them."""
    found: list[Placement] = []
    for placement in placements:
        if placement.entry == port:
            found.insert(0 if placement.ahead else len(found), placement)
    return found


def compose(model: Model, placements: Sequence[Placement] = ()) -> System:
    """The equations of `model` with `placements` at its ports.

    Raises:
        ModelError: a port is unknown or of another kind, an expression does not parse or has wrong
            units.
    """
    for placement in placements:
        _check_port(model, placement)
    system = _Composer(model, tuple(placements)).system()
    late = {symbol(name) for name in system.delayed}
    if any(late & output.free_symbols for output in system.outputs.values()):
        # Read at once, what changes in steps would be no smooth function of when it changes.
        return _Composer(model, tuple(placements), exact=False).system()
    return system


def _check_port(model: Model, placement: Placement) -> None:
    port = model.ports.get(placement.port)
    if port is None:
        known = ", ".join(model.ports) or "a model with ports"
        raise ModelError(
            f"effect {placement.name}: found port {placement.port!r}, expected one of {known}"
        )
    if placement.entry not in model.ports:
        known = ", ".join(elements_at(model, placement.port)) or "none"
        raise ModelError(
            f"effect {placement.name}: found beyond = {placement.beyond!r}, expected an element of"
            f" the base at {placement.port}: {known}"
        )
    if not placement.effect.fits(port.kind):
        raise ModelError(
            f"effect {placement.name}: found port {placement.port!r} of kind {port.kind},"
            f" expected kind {placement.effect.port}"
        )


class _Composer:
    """Builds the scope in order of dependence.

    Inputs and states come first, then actuators, forces, equations and outputs, and finally
    sensors. Each is read in a scope that contains everything it may use. A quantity is added as
    soon as everything that it uses is defined, and the actuator that it drives after it.

    Args:
        model, placements: as for `compose`.
        exact: whether held inputs are delayed exactly.
    """

    def __init__(
        self, model: Model, placements: tuple[Placement, ...], *, exact: bool = True
    ) -> None:
        self._model, self._placements, self._exact = model, placements, exact
        self._delayed: dict[str, Delayed] = {}
        self._without_states: dict[str, Placement] = {}
        self._states, self._parameters = dict(model.states), dict(model.parameters)
        self._rates: dict[str, sympy.Expr] = {}
        self._variables: dict[str, dict[str, sympy.Expr]] = {}
        self._updates: dict[str, sympy.Expr] = {}
        self._scope = Scope()
        self._present = sympy.Integer(1) if model.presence is None else symbol(PRESENT)
        self._spelt_out = spelt_out(model)
        self._waiting = list(in_order(model))
        self._scope.define(TIME, symbol(TIME), "s")
        for table in (model.inputs, model.states, model.parameters):
            self._scope.define_all({n: item.shown or item.unit for n, item in table.items()})

    def system(self) -> System:
        self._join(self._known())
        ports = self._entered("actuator", "inner", "force")
        self._join(self._waiting)
        model_rates = {
            name: self._scope.read(state.derivative, f"({state.unit})/s", f"state {name}")
            for name, state in self._model.states.items()
        }
        self._rates = model_rates | self._rates
        outputs = {
            name: self._scope.read(output.expression, output.unit, f"output {name}")
            for name, output in self._model.outputs.items()
        }
        for name, output in outputs.items():
            self._scope.define(name, output, self._model.outputs[name].unit)
        sensors = self._entered("sensor")
        outputs |= {self._model.ports[name].signal: value for name, value in sensors.items()}
        return System(
            self._spelt_out,
            tuple(self._without_states.get(each.prefix, each) for each in self._placements),
            self._states,
            self._parameters,
            self._rates,
            outputs,
            ports | sensors,
            tuple(PROBE + name for name in ports),
            self._updates,
            self._delayed,
        )

    def _known(self) -> list[str]:
        """Quantities whose dependencies are all defined, in order of dependence."""
        known, found = set(self._scope.meanings), []
        for name in self._waiting:
            if names_in(self._model.quantities[name].expression, f"quantity {name}") <= known:
                known.add(name)
                found.append(name)
        return found

    def _join(self, names: list[str]) -> None:
        """Define quantities by their expressions."""
        for name in names:
            own = self._model.quantities[name]
            meaning = self._scope.read(own.expression, own.unit, f"quantity {name}")
            self._scope.define(name, meaning, own.shown or own.unit)
        self._waiting = [name for name in self._waiting if name not in names]

    def _entered(self, *kinds: str) -> dict[str, sympy.Expr]:
        """The ports of some kinds with their effects, in order of dependence."""
        ports = self._model.ports
        waiting = [name for kind in kinds for name, port in ports.items() if port.kind == kind]
        values = {}
        while waiting:
            ready = (n for n in waiting if self._is_ready(n, waiting))
            # Of those that are never ready the one in the wrong is told, not one that waits for it.
            circular = (n for n in waiting if self._needs_itself(n))
            name = next(chain(ready, circular, waiting))
            values[name] = self._enter(name, ports[name])
            waiting.remove(name)
        return values

    def _is_ready(self, name: str, waiting: list[str]) -> bool:
        """Whether all that a port's signal and variables use is defined, but for itself."""
        behind = self._model.ports[name].signal in self._waiting
        return not behind and not self._in_variables(name) & {*waiting} - {name}

    def _in_variables(self, name: str) -> frozenset[str]:
        """Names that a port's variables use, quantities spelt out."""
        texts = (own.expression for own in self._spelt_out.ports[name].variables.values())
        return frozenset().union(*(names_in(text, f"port {name}: variable") for text in texts))

    def _needs_itself(self, name: str) -> bool:
        """Whether a port's signal uses what enters there, also through quantities."""
        port, quantities = self._spelt_out.ports[name], self._spelt_out.quantities
        text = quantities[port.signal].expression if port.signal in quantities else ""
        return bool(text) and name in names_in(text, "signal")

    def _enter(self, name: str, port: Port) -> sympy.Expr:
        """A port with its effects, added to the scope."""
        probe = symbol(PROBE + name) if port.kind != "sensor" else sympy.Integer(0)
        value = self._with_own(name, port) + self._present * probe
        self._scope.define(name, value, self._port_unit(name, port))
        self._join(self._known())
        return value

    def _with_own(self, name: str, port: Port) -> sympy.Expr:
        """A port with its effects, whose variables may contain what enters there."""
        if port.kind == "sensor" or name not in self._in_variables(name):
            self._variables[name] = self._port_variables(name, port)
            return self._port_value(name, port)

        def value(entering: sympy.Expr) -> sympy.Expr:
            self._variables[name] = self._port_variables(name, port, entering)
            return self._port_value(name, port)

        found = solved(value, symbol(name))
        if found is None:
            return value(self._arriving(port))
        value(found)  # What effects there remember follows what enters with them.
        return found

    def _arriving(self, port: Port) -> sympy.Expr:
        """What enters at a port without effects."""
        return sympy.Integer(0) if port.kind == "force" else self._scope.meanings[port.signal]

    def _port_unit(self, name: str, port: Port) -> str:
        if port.kind == "force":
            return port.unit
        table = signals_at(self._model, port)
        if port.signal not in table:
            raise ModelError(
                f"port {name}: found signal {port.signal!r}, expected one of {', '.join(table)}"
            )
        if port.signal in self._waiting:
            raise ModelError(
                f"port {name}: found signal {port.signal!r}, which depends on what enters at {name}"
                " or at a port behind it, expected what does not"
            )
        return table[port.signal].unit

    def _port_value(self, name: str, port: Port) -> sympy.Expr:
        unit = self._port_unit(name, port)
        value, added = self._arriving(port), port.kind == "force"
        for placement in signal_order(self._placements, name):
            acting = self._effect_value(placement, port, value, unit)
            value = self._where_present(value, value + acting if added else acting)
        return value

    def _where_present(self, without: sympy.Expr, acting: sympy.Expr) -> sympy.Expr:
        """A port with an effect where it is present, and without it elsewhere."""
        return acting if self._present == 1 else without + self._present * (acting - without)

    def _effect_value(
        self, placement: Placement, port: Port, arriving: sympy.Expr, unit: str
    ) -> sympy.Expr:
        """An effect's force at a force port, or its output signal at a signal port."""
        if self._is_exact(placement, port, arriving):
            return self._delayed_by(placement, arriving)
        scope = self._local_scope(placement, port, arriving, unit)
        for name, state in placement.effect.states.items():
            label, where = placement.prefix + name, f"{placement}: state {name}"
            unit_of = self._states[label].unit
            if state.update:
                self._rates[label] = sympy.Integer(0)
                self._updates[label] = scope.read(state.update, unit_of, where)
            else:
                self._rates[label] = scope.read(state.derivative, f"({unit_of})/s", where)
        return scope.read(placement.effect.expression, unit, str(placement))

    def _is_exact(self, placement: Placement, port: Port, arriving: sympy.Expr) -> bool:
        """Whether an effect only delays what is held between samples.

        That changes in steps, each of which can be integrated up to its own instant. Effects with
        memory at the same port would have to follow.
        """
        if not (self._exact and placement.effect.delays and self._model.states):
            return False
        order = signal_order(self._placements, placement.entry)
        alone = not any(each.effect.states for each in order if each is not placement)
        known = {symbol(name) for name in (*self._model.inputs, *self._parameters)}
        return alone and hold_at(self._model, port) == "zero" and arriving.free_symbols <= known

    def _delayed_by(self, placement: Placement, arriving: sympy.Expr) -> sympy.Expr:
        """What arrives, with its inputs delayed by an effect."""
        effect = structs.replace(placement.effect, states={}, expression="u")
        own = self._without_states[placement.prefix] = replace(placement, effect=effect)
        self._adopt(own)
        late = {}
        for name in self._model.inputs:
            if symbol(name) in arriving.free_symbols:
                label = f"{placement.prefix}{name}"
                self._delayed[label] = Delayed(name, placement.prefix + effect.delays)
                late[symbol(name)] = symbol(label)
        return arriving.xreplace(late)

    def _local_scope(
        self, placement: Placement, port: Port, arriving: sympy.Expr, unit: str
    ) -> Scope:
        """The effect's own scope; its parameters and states are added to the system."""
        scope = Scope()
        scope.define(TIME, symbol(TIME), "s")
        for name, meaning in self._variables[placement.entry].items():
            scope.define(name, meaning, port.variables[name].unit)
        if port.kind != "force":
            scope.define("u", arriving, unit)
            held = port.kind == "sensor" or hold_at(self._model, port) == "zero"
            scope.define(LEFT, symbol(UNTIL) if held else sympy.Integer(0), "s")
        self._adopt(placement)
        for name in (*placement.effect.parameters, *placement.effect.states):
            label = placement.prefix + name
            own = self._parameters.get(label) or self._states[label]
            scope.define(name, symbol(label), own.shown or own.unit)
        return scope

    def _port_variables(
        self, name: str, port: Port, entering: sympy.Expr | None = None
    ) -> dict[str, sympy.Expr]:
        """Variables that effects at a port may use, where `entering` enters at the port itself."""
        found, scope, variables = {}, self._scope, port.variables
        later = {*self._waiting, *self._model.ports}
        if entering is not None:
            scope, variables = self._scope.copy(), self._spelt_out.ports[name].variables
            scope.define(name, entering, self._port_unit(name, port))
        for key, own in variables.items():
            where = f"port {name}: variable {key}"
            for waiting in (names_in(own.expression, where) - scope.meanings.keys()) & later:
                raise ModelError(
                    f"{where}: found {waiting!r}, which depends on what enters at {name} or at a"
                    " port behind it, expected what does not"
                )
            found[key] = scope.read(own.expression, own.unit, where)
        return found

    def _adopt(self, placement: Placement) -> None:
        effect = placement.effect.at(units_at(self._model, placement.port), str(placement))
        for name, p in effect.parameters.items():
            self._parameters[placement.prefix + name] = Parameter(
                value=1.0 if p.role == "switch" else p.value,
                unit=p.unit,
                shown=p.shown,
                low=p.low,
                high=p.high,
                fixed=p.role in ("constant", "switch"),
                meaning=f"{placement.name}, {name}",
            )
        for name, s in effect.states.items():
            self._states[placement.prefix + name] = State(
                unit=s.unit, derivative=s.derivative or s.update, start=s.start, low=s.low,
                high=s.high, shown=s.shown,
            )  # fmt: skip


def units_at(model: Model, name: str) -> dict[str, str]:
    """Units of a port as written, by the names that effects use in braces."""
    port = model.ports[name]
    own = port if port.kind == "force" else signals_at(model, port)[port.signal]
    units = {"F" if port.kind == "force" else "u": own.shown or own.unit}
    units |= {name: v.shown or v.unit for name, v in port.variables.items()}
    # A distance is a speed times a time, even if no equation uses it.
    if "v" in units:
        units.setdefault("x", f"({units['v']})*s")
    return units

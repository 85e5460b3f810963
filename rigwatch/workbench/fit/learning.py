"""What a rough model learns from a healthy recording: terms that windows not fitted gain by.

Every set of terms (`learned_terms.py`) is fitted for itself to one part of the recording, the
smaller ones first, and each from the best that it contains or, where that leads nowhere, from the
model without terms; the rest of the recording decides. Of
those that leave as little as any the one with the fewest kinds of terms is taken, so that no order
in which terms are tried matters.

A set is taken only if its fit has converged, and if the model stays where it belongs: products may
hold several equilibria, and one that nobody has seen is met by the next recording.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Model, Output, compose
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, port_sizes
from rigwatch.workbench.fit.fitted_model import Fitted
from rigwatch.workbench.fit.learned_terms import with_friction, with_products
from rigwatch.workbench.fit.whole_fit import fit_whole
from rigwatch.workbench.study import Study

FIT_SHARE = 0.6
"""Share of the healthy recording that terms are fitted to; the rest decides on them."""
WORTH = 0.03
"""Share by which the error of windows that were not fitted must fall for more terms."""
SEARCHES = 5
"""Drawn starts of the model without terms, beside its own values."""
LARGER = 1.2
"""Motion over the healthy one under which a model must still stay bounded."""
FAR = 3.0
"""States that a run begins in, over their own sizes."""
TOGETHER, BOUNDED = 0.02, 3.0
"""How far runs may be apart at last, and how large they may become, in sizes of the output."""

Sizes = Mapping[str, Mapping[str, float]]
Term = Callable[[Model, Sizes], Model]
TERMS: Mapping[str, Term] = {
    "friction": with_friction,
    "products of three": lambda model, sizes: with_products(model, sizes, 3),
    "products of two": lambda model, sizes: with_products(model, sizes, 2),
}
"""What may be learned, by what it is called."""


@dataclass(frozen=True, eq=False)
class Learned:
    """What a healthy recording has taught.

    Attributes:
        model: along the measured motion, its learned parameters free.
        fitted: it, fitted to the healthy recording.
        steps: what was added.
    """

    model: Model
    fitted: Fitted
    steps: tuple[str, ...]


def learn(study: Study, healthy: Recording, horizon: int) -> Learned:
    """The model along the measured motion with the terms that a healthy recording is worth.

    Args:
        study: with its model along the measured motion.
        healthy: recording for the model along the measured motion.
        horizon: samples of a window.

    Raises:
        ModelError: not even the model without terms can be simulated.
    """
    bare = _loose(study.model)
    both = _split(healthy, horizon)
    first = fit_whole(study, bare, both, study.file.start, SEARCHES)
    test = Staying(first, healthy)
    models: dict[tuple[str, ...], Model] = {(): bare}
    fits: dict[tuple[str, ...], Fitted] = {(): first}
    for chosen in _sets():
        model = _with_terms(bare, test.sizes, chosen)
        if model is None:
            continue
        parents = [fits[less] for less in fits if set(less) < set(chosen)]
        begin = min(parents, key=lambda fitted: fitted.held_out_error)
        tried = _usable(study, model, both, [begin, first], test)
        if tried is not None:
            models[chosen], fits[chosen] = model, tried
    whole = Data(healthy, healthy, None, horizon, ())
    for chosen in _best_first(fits):
        found = _usable(study, models[chosen], whole, [fits[chosen]], test)
        if found is not None:
            return Learned(models[chosen], found, chosen)
    return Learned(bare, fit_whole(study, bare, whole, first.train.values()), ())


def _sets() -> list[tuple[str, ...]]:
    """Sets of terms, the smaller ones first."""
    return [chosen for n in range(1, len(TERMS) + 1) for chosen in combinations(TERMS, n)]


def _with_terms(model: Model, sizes: Sizes, chosen: tuple[str, ...]) -> Model | None:
    """The model with a set of terms; None where one of them has no place in it."""
    for name in chosen:
        larger = TERMS[name](model, sizes)
        if larger is model:
            return None
        model = larger
    return model


def _best_first(fits: Mapping[tuple[str, ...], Fitted]) -> list[tuple[str, ...]]:
    """Sets that leave as little as any, the smallest of them first; then the others."""
    least = min(fitted.held_out_error for fitted in fits.values())

    def order(chosen: tuple[str, ...]) -> tuple[bool, int, float]:
        error = fits[chosen].held_out_error
        worse = (1 - WORTH) * error > least
        return worse, 0 if worse else len(chosen), error

    return sorted(fits, key=order)


def _usable(
    study: Study, model: Model, data: Data, begin: Sequence[Fitted], test: "Staying"
) -> Fitted | None:
    """A model's fit from the first of several fits that leads to a usable one; None if none does.

    One that diverges, has not converged, or does not stay where it belongs is not used.
    """
    for start in begin:
        try:
            found = fit_whole(study, model, data, start.train.values())
        except ModelError:
            continue
        if found.convergence is not None and found.convergence.converged and test.stays(found):
            return found
    return None


class Staying:
    """Whether models stay where they belong under a motion larger than any that was fitted.

    Runs from different states must come together, as those of the model without terms do, which is
    linear and stable; and they must stay as large as the output.

    Args:
        bare: the model without terms.
        healthy: recording of a healthy rig.

    Attributes:
        sizes: of each port's variables, those of hidden states as the model without terms has them.
    """

    def __init__(self, bare: Fitted, healthy: Recording) -> None:
        self._healthy = healthy
        model = bare.compiled.system.model
        self._states = _state_sizes(bare, healthy)
        self.sizes = _of_states(model, port_sizes(model, healthy), self._states)
        self._apart = self._run(bare)[0]

    def stays(self, fitted: Fitted) -> bool:
        """Whether one does."""
        size = np.nanstd(self._healthy.outputs, axis=0)
        apart, reached = self._run(fitted)
        together = apart < TOGETHER * size + 2 * self._apart
        return bool(np.all(together) and np.all(reached < BOUNDED * size))

    def _run(self, fitted: Fitted) -> tuple[FloatArray, FloatArray]:
        """How far runs are apart at last, and how large they become; each (outputs,)."""
        healthy = self._healthy
        far = FAR * np.array(list(self._states.values()))
        run = fitted.compiled.simulate(
            LARGER * healthy.inputs, healthy.dt, np.zeros(3, np.int64), len(healthy),
            initial=np.stack([0 * far, far, -far]), parameters=fitted.train.parameters,
            substeps=fitted.substeps,
        )  # fmt: skip
        later = run.outputs[:, len(healthy) // 2 :]
        apart = np.sqrt(np.mean((later[1:] - later[:1]) ** 2, axis=(0, 1)))
        return apart, np.sqrt(np.mean(later**2, axis=(0, 1)))


def _state_sizes(fitted: Fitted, recording: Recording) -> dict[str, float]:
    """Root mean squares of the hidden states that a model simulates, by name."""
    model, values = fitted.compiled.system.model, fitted.train.values()
    parameters = {
        name: structs.replace(p, value=values[name], fixed=True, kept=False)
        for name, p in model.parameters.items()
    }
    ports = {name: port for name, port in model.ports.items() if port.kind != "sensor"}
    outputs = {name: Output(unit=s.unit, expression=name) for name, s in model.states.items()}
    shown = structs.replace(model, parameters=parameters, ports=ports, outputs=outputs)
    compiled = compile_system(compose(shown))
    run = compiled.simulate(
        recording.inputs, recording.dt, np.zeros(1, np.int64), len(recording),
        initial=np.zeros((1, len(model.states))), parameters=compiled.parameters,
        substeps=fitted.substeps,
    )  # fmt: skip
    sizes = np.sqrt(np.mean(run.outputs[0, len(recording) // 4 :] ** 2, axis=0))
    return dict(zip(model.states, sizes.tolist(), strict=True))


def _of_states(model: Model, sizes: Sizes, states: Mapping[str, float]) -> Sizes:
    """Sizes of the ports' variables, those of hidden states replaced."""
    found = {port: dict(own) for port, own in sizes.items()}
    for port, own in found.items():
        for name, variable in model.ports[port].variables.items():
            if variable.expression in states:
                own[name] = states[variable.expression] or 1.0
    return found


def _split(healthy: Recording, horizon: int) -> Data:
    """A part of the recording that is fitted, and the rest, which decides."""
    windows = len(healthy) // horizon
    cut = max(round(FIT_SHARE * windows), 1) * horizon
    if cut >= len(healthy):
        return Data(healthy, healthy, None, horizon, ())
    first, rest = (
        Recording(healthy.dt, healthy.inputs[part], healthy.outputs[part])
        for part in (slice(cut), slice(cut, None))
    )
    return Data(first, rest, None, horizon, ())


def _loose(model: Model) -> Model:
    """The model with all that a healthy recording may tell free, but what forces divide by."""
    parameters = {
        name: structs.replace(p, fixed=not p.kept, kept=p.kept)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=parameters)

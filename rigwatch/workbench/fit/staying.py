"""Whether a model along the measured motion stays where it belongs.

Products of motion may hold several equilibria, and one that nobody has seen is met by the next
recording. So a model is run from different states under a motion larger than the healthy one.
"""

from collections.abc import Mapping

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Model, Output, compose
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import port_sizes
from rigwatch.workbench.fit.fitted_model import Fitted

LARGER = 1.2
"""Motion over the healthy one under which a model must still stay bounded."""
FAR = 3.0
"""States that a run begins in, over their own sizes."""
TOGETHER, BOUNDED = 0.02, 3.0
"""How far runs may be apart at last, and how large they may become, in sizes of the output."""
SETTLED = 4
"""Part of a recording after which hidden states have forgotten where they began: one in so many."""

Sizes = Mapping[str, Mapping[str, float]]
"""Of each port's variables, in their units."""


class Staying:
    """A test of models against the one without terms.

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
    sizes = np.sqrt(np.mean(run.outputs[0, len(recording) // SETTLED :] ** 2, axis=0))
    return dict(zip(model.states, sizes.tolist(), strict=True))


def _of_states(model: Model, sizes: Sizes, states: Mapping[str, float]) -> Sizes:
    """Sizes of the ports' variables, those of hidden states replaced."""
    found = {port: dict(own) for port, own in sizes.items()}
    for port, own in found.items():
        for name, variable in model.ports[port].variables.items():
            if variable.expression in states:
                own[name] = states[variable.expression] or 1.0
    return found

"""Whether a model along the measured motion stays bounded and forgets its initial state.

A model with products of the motion may have several equilibria, and another recording may reach one
that the training data do not show. The model is therefore simulated from different initial states
under a motion larger than the healthy one.
"""

from collections.abc import Mapping

import numpy as np

from rigwatch.physics.engine.equations import Model
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import port_sizes, simulated_states
from rigwatch.workbench.fit.fitted import Fitted

MOTION_GAIN = 1.2
"""Ratio of the test motion to the healthy motion."""
INITIAL_STATES = 3.0
"""Initial states of the test runs, in multiples of the rms of each state."""
CONVERGED, BOUNDED = 0.02, 3.0
"""Largest final difference between runs, and largest rms, relative to the output's deviation."""
SETTLING_PARTS = 4
"""Hidden states have settled after one of this many equal parts of a recording."""

Sizes = Mapping[str, Mapping[str, float]]
"""Rms of each port's variables, in their units."""


class BoundednessTest:
    """Tests models against the one without learned terms.

    Runs from different initial states must converge, as those of the model without terms do, which
    is linear and stable; and they must stay within a few times the output's deviation.

    Args:
        bare: the model without terms.
        healthy: recording of a healthy rig.

    Attributes:
        sizes: rms of each port's variables; for hidden states, as simulated without terms.
    """

    def __init__(self, bare: Fitted, healthy: Recording) -> None:
        self._healthy = healthy
        model = bare.compiled.system.model
        self._states = _state_sizes(bare, healthy)
        self.sizes = _of_states(model, port_sizes(model, healthy), self._states)
        self._apart = self._run(bare)[0]

    def passes(self, fitted: Fitted) -> bool:
        """Whether a fitted model passes the test."""
        size = np.nanstd(self._healthy.outputs, axis=0)
        apart, reached = self._run(fitted)
        together = apart < CONVERGED * size + 2 * self._apart
        return bool(np.all(together) and np.all(reached < BOUNDED * size))

    def _run(self, fitted: Fitted) -> tuple[FloatArray, FloatArray]:
        """Final difference between runs, and their rms; each of shape (outputs,)."""
        healthy = self._healthy
        far = INITIAL_STATES * np.array(list(self._states.values()))
        run = fitted.compiled.simulate(
            MOTION_GAIN * healthy.inputs, healthy.spacing, np.zeros(3, np.int64), len(healthy),
            initial=np.stack([0 * far, far, -far]), parameters=fitted.train.parameters,
            substeps=fitted.substeps,
        )  # fmt: skip
        later = run.outputs[:, len(healthy) // 2 :]
        apart = np.sqrt(np.mean((later[1:] - later[:1]) ** 2, axis=(0, 1)))
        return apart, np.sqrt(np.mean(later**2, axis=(0, 1)))


def _state_sizes(fitted: Fitted, recording: Recording) -> dict[str, float]:
    """Rms of the hidden states that a model simulates, by name."""
    model = fitted.compiled.system.model
    run = simulated_states(
        model, recording, fitted.train.values(),
        initial=np.zeros(len(model.states)), substeps=fitted.substeps,
    )  # fmt: skip
    sizes = np.sqrt(np.mean(run[len(recording) // SETTLING_PARTS :] ** 2, axis=0))
    return dict(zip(model.states, sizes.tolist(), strict=True))


def _of_states(model: Model, sizes: Sizes, states: Mapping[str, float]) -> Sizes:
    """Rms of the ports' variables, with those of hidden states replaced."""
    found = {port: dict(own) for port, own in sizes.items()}
    for port, own in found.items():
        for name, variable in model.ports[port].variables.items():
            if variable.expression in states:
                own[name] = states[variable.expression] or 1.0
    return found

"""Compares fits of models with states that no channel shows, such as the current of a motor.

Every window of a fit has its own initial states. A hidden state that hardly changes over a window
is a free constant in each: with an inductance that is far too large, the current follows whatever
the model lacks, and the error is smaller than at the true inductance. Optima are therefore compared
with hidden states continued from window to window, as held-out recordings are judged.
"""

from rigwatch.physics.engine.equations import System
from rigwatch.physics.engine.fit import Fit, Recording, evaluate, shown_states
from rigwatch.physics.engine.search.convergence import spread


def has_hidden_states(system: System) -> bool:
    """Whether the model has a state that no channel shows."""
    return not set(range(len(system.model.states))) <= shown_states(system)


def continued_spread(found: Fit, recording: Recording, horizon: int, substeps: int) -> float:
    """Root mean square of the scaled residuals with hidden states continued.

    Args:
        found: the fit.
        recording, horizon, substeps: what it was fitted to, as in `fit`.

    Raises:
        ModelError: the continued states diverge.
    """
    if found.continued:
        return spread(found)
    judged = evaluate(found, recording, horizon, substeps, found.initial, judging=True)
    return max(spread(judged), spread(found))

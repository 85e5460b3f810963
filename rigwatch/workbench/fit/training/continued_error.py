"""The training error with states of effects continued from window to window.

A fit finds the initial states of each window, and a state of an effect that decays over more than a
window, such as that of an AC-coupled sensor, is then a free constant in each. Training errors of
different effects can be compared only if such states are continued, as on held-out recordings.
"""

from rigwatch.physics.engine.fit import evaluate
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit.fitted import Fitted, overall_error


def continued_train_error(fitted: Fitted, data: Data) -> float:
    """Training error over all channels.

    That of the fit itself if it continues hidden states already, or no effect has any.

    Raises:
        ModelError: the continued states diverge.
    """
    states = any(placement.effect.states for placement in fitted.placements)
    if fitted.train.continued or not states:
        return fitted.train_error
    train = fitted.train
    judged = evaluate(
        train, data.train, fitted.horizon, fitted.substeps, train.initial, judging=True
    )
    return overall_error(judged)

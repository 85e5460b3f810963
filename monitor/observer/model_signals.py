"""From admitted samples to what is decided on: motion, prediction, residual in one stage.

Which channel is an input, which shows the motion and which is predicted follows from the model of
equations; nothing here knows what a rig measures.
"""

from dataclasses import dataclass

import numpy as np

from monitor.model import EquationsPlant, RemainderSection
from monitor.observer.lagged_motion import DELAY, MATCHED, FixedLag, MotionColumn
from monitor.observer.missing_force import HighPassed
from monitor.observer.prediction import (
    AlongMotion,
    Predicted,
    base_model,
    predicted_channel,
    rate_columns,
    speed_state,
)
from monitor.signals import Codes
from rigwatch.physics.engine.equations import Model, balanced_states, measured_states
from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True)
class Layout:
    """How a model's signals are laid out.

    Attributes:
        channels: read from the samples: inputs, then motion, then what is predicted.
        columns: made of them: inputs, motion, measured output, the motion's own second view of
            that output, and the output smoothed as that is.
        inputs: how many inputs and motions drive the equations.
        speed: place among them of the speed that friction acts against.
        motions: of them, the places of the motion.
        rates: of them, the places of rates of change.
        signals: names of them.
    """

    channels: tuple[str, ...]
    columns: tuple[MotionColumn, ...]
    inputs: int
    speed: int
    motions: tuple[int, ...]
    rates: tuple[int, ...]
    signals: tuple[str, ...]


def layout_of(model: Model, port: str) -> Layout:
    """The layout of a model as it was written.

    Raises:
        ModelError: nothing measured is left to predict.
    """
    inputs = [own.channel or name for name, own in model.inputs.items()]
    motion = measured_states(model)
    shown = list(dict.fromkeys(state.channel for state in motion))
    channels = (*inputs, *shown, predicted_channel(model))
    places = {name: place for place, name in enumerate(channels)}
    columns = [MotionColumn(place, DELAY) for place in range(len(inputs))]
    columns += [MotionColumn(places[state.channel], state.order) for state in motion]
    columns.append(MotionColumn(len(channels) - 1, DELAY))
    balance = balanced_states(model)[0]
    columns.append(MotionColumn(places[balance.channel], balance.order + 1))
    columns.append(MotionColumn(len(channels) - 1, MATCHED if balance.order == 1 else 0))
    names = [*model.inputs, *(state.name for state in motion)]
    return Layout(
        channels,
        tuple(columns),
        len(names),
        names.index(speed_state(model, port)),
        tuple(range(len(inputs), len(names))),
        tuple(rate_columns(model)),
        tuple(names),
    )


@dataclass(frozen=True, eq=False)
class Observed:
    """What the stage gives for each sample, all of one instant, `half_width` samples ago.

    Attributes:
        state: see `motion.FixedLag`, shape (n,).
        rows: inputs and motion, shape (n, inputs).
        measured: the measured output, shape (n,).
        predicted: the equations' columns.
        judged: high-passed, columns of `residual.COLUMNS`, shape (n, 6).
    """

    state: Codes
    rows: FloatArray
    measured: FloatArray
    predicted: Predicted
    judged: FloatArray


class ObserverSignals:
    """The running stage.

    Args:
        plant: the equations with their parameters.
        remainder: what they leave of a healthy rig.
        rate: samples a second [Hz].

    Raises:
        ModelError: the plant's model does not fit.
    """

    def __init__(self, plant: EquationsPlant, remainder: RemainderSection, rate: float) -> None:
        self.layout = layout_of(base_model(plant.model), plant.port)
        self._motion = FixedLag(self.layout.columns, plant.half_width, rate)
        self._along = AlongMotion(plant, rate)
        self.remainder_size = len(self.layout.motions) + self._along.hidden
        self._high_passed = HighPassed(plant.corner, rate, remainder)

    def update(self, signals: FloatArray, code: Codes) -> Observed:
        """The next samples, shape (n, channels) in the layout's order."""
        columns, state = self._motion.update(signals, code)
        inputs = self.layout.inputs
        rows, measured = columns[:, :inputs], columns[:, inputs]
        disagreement = columns[:, inputs + 2] - columns[:, inputs + 1]
        predicted = self._along.update(rows, state)
        raw = np.column_stack(
            [
                measured - predicted.output, predicted.dry, predicted.viscous, predicted.output,
                disagreement, measured,
            ]
        )  # fmt: skip
        z = remainder_signals(rows, predicted, self.layout)
        judged = self._high_passed.update(raw, z, state)
        return Observed(state, rows, measured, predicted, judged)


def remainder_signals(rows: FloatArray, predicted: Predicted, layout: Layout) -> FloatArray:
    """Motion and hidden states, shape (n, signals): what a healthy remainder is a function of."""
    return np.ascontiguousarray(np.hstack([rows[:, list(layout.motions)], predicted.hidden]))

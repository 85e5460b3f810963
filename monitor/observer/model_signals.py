"""From admitted samples to judged signals: motion, prediction and residual in one stage.

The roles of channels (input, motion, predicted output) follow from the model of equations; nothing
here is specific to a rig.
"""

from dataclasses import dataclass

import numpy as np

from monitor.drives import DriveBands, DriveChanges, DriveStops, InputSteps, Steps
from monitor.model import BANDS, EquationsPlant, RemainderSection
from monitor.observer.lagged_motion import (
    DELAY,
    EMPTY,
    MATCHED,
    STEPPED,
    STEPPED_BEFORE,
    FixedLag,
    MotionColumn,
)
from monitor.observer.missing_force import LATE_UNIT, HighPassed
from monitor.observer.prediction import (
    UNIT_FRICTION,
    WITH_OTHER_INPUTS,
    AlongMotion,
    Predicted,
    Run,
    equations_of,
    predicted_channel,
    rate_columns,
    speed_state,
)
from monitor.signals import Codes
from rigwatch.physics.engine.equations import Model, balanced_states, measured_states, sensor_states
from rigwatch.wire.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class Layout:
    """Layout of a model's signals.

    Attributes:
        channels: read from the samples: inputs, then motion, then predicted outputs.
        columns: computed from them: inputs, motion, measured output, the same output derived from
            the motion, the output with equal smoothing, and the inputs' steps around each sample
            and before it.
        inputs: number of inputs and motions that drive the equations.
        speed: index among them of the speed that friction opposes.
        motions: indices among them of the motion.
        rates: indices among them of rates of change.
        signals: their names.
        sensed: indices among the remainder's signals, motion and hidden states, of those states
            that only a sensor keeps.
    """

    channels: tuple[str, ...]
    columns: tuple[MotionColumn, ...]
    inputs: int
    speed: int
    motions: tuple[int, ...]
    rates: tuple[int, ...]
    signals: tuple[str, ...]
    sensed: tuple[int, ...]

    @property
    def balance(self) -> MotionColumn:
        """The predicted output as derived from the motion."""
        return self.columns[self.inputs + 1]


def layout_of(model: Model, port: str) -> Layout:
    """The layout for an unmodified model.

    Raises:
        ModelError: no measured output is left to predict.
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
    for order in (STEPPED, STEPPED_BEFORE):
        columns += [MotionColumn(place, order) for place in range(len(inputs))]
    names = [*model.inputs, *(state.name for state in motion)]
    hidden = [name for name in model.states if name not in names]
    kept, first = sensor_states(model), len(motion)
    return Layout(
        channels,
        tuple(columns),
        len(names),
        names.index(speed_state(model, port)),
        tuple(range(len(inputs), len(names))),
        tuple(rate_columns(model)),
        tuple(names),
        tuple(first + k for k, name in enumerate(hidden) if name in kept),
    )


@dataclass(frozen=True, eq=False)
class Observed:
    """Results of the stage for each sample, all for the instant `half_width` samples earlier.

    Attributes:
        state: see `lagged_motion.FixedLag`, shape (n,).
        rows: inputs and motion, shape (n, inputs).
        measured: the measured output, shape (n,).
        predicted: the columns of the prediction.
        judged: high-passed columns, see `missing_force`, shape (n, JUDGED); the decision corrects
            the residual for the inputs' edges, and chooses the response to later inputs.
        steady: False where an input changes suddenly, stops, or steps between samples at a place
            that is not known yet, shape (n,).
        drive: pace of the first input, see `monitor.drives.Drive`, shape (n,).
        bands: energies of the first input, see `monitor.drives.DriveBands`, shape (n, bands).
        arguments: of the remainder: motion and hidden states, shape (n, signals).
    """

    state: Codes
    rows: FloatArray
    measured: FloatArray
    predicted: Predicted
    judged: FloatArray
    steady: BoolArray
    drive: FloatArray
    bands: FloatArray
    arguments: FloatArray

    def part(self, begin: int, end: int) -> "Observed":
        """Samples `begin` to before `end`."""
        at = slice(begin, end)
        return Observed(
            self.state[at], self.rows[at], self.measured[at], self.predicted.part(at),
            self.judged[at], self.steady[at], self.drive[at], self.bands[at],
            self.arguments[at],
        )  # fmt: skip


class LaggedSignals:
    """The layout's columns from samples: the smoothed motion, and the inputs' means.

    Args:
        layout: of the model.
        half_width: lag [samples].
        rate: sample rate [Hz].
        late: lateness of the motion behind the predicted output's sensor [s].
        jitters: whether inputs whose steps seem to jitter are known to do so.
    """

    def __init__(
        self, layout: Layout, half_width: int, rate: float, late: float, jitters: bool = False
    ) -> None:
        self._motion = FixedLag(layout.columns, half_width, rate, late)
        places = range(layout.motions[0])
        self._inputs = [InputSteps(half_width, jitters) for _ in places]
        delayed = [MotionColumn(place, DELAY) for place in places]
        self._held = FixedLag(delayed, half_width, rate, fills=False) if delayed else None

    def update(self, signals: FloatArray, code: Codes) -> tuple[FloatArray, Codes, Steps]:
        """Columns, states, and what is known of the inputs' steps, for the next samples.

        The steps are of all inputs: `mean` and `moved` have a column for each.
        """
        columns, state = self._motion.update(signals, code)
        filled = np.zeros((code.size, len(self._inputs)))
        if self._held is not None:
            filled = columns[:, : len(self._inputs)] - self._held.update(signals, code)[0]
        known, unsure = np.ones(code.size, np.bool_), np.zeros(code.size)
        jitters = np.ones(code.size, np.bool_)
        moved, moves = np.zeros((code.size, len(self._inputs))), np.zeros(code.size, np.bool_)
        for place, steps in enumerate(self._inputs):
            found = steps.update(signals[:, place], code)
            columns[:, place] = np.where(state == EMPTY, 0.0, found.mean + filled[:, place])
            known &= found.known
            unsure = np.maximum(unsure, found.unsure)
            jitters &= found.jitters | (found.unsure == 0.0)
            moved[:, place] = np.where(found.moves, found.moved, 0.0)
            moves |= found.moves
        mean = columns[:, : len(self._inputs)]
        return columns, state, Steps(mean, known, unsure, jitters & (unsure > 0.0), moved, moves)


class ObserverSignals:
    """The running stage.

    Args:
        plant: the equations with their parameters.
        remainder: their residual on a healthy rig.
        rate: sample rate [Hz].
        jitters: whether inputs whose steps seem to jitter are known to do so.

    Raises:
        ModelError: the plant does not match its model.
    """

    def __init__(
        self,
        plant: EquationsPlant,
        remainder: RemainderSection,
        rate: float,
        jitters: bool = False,
    ) -> None:
        self.layout = layout_of(equations_of(plant), plant.port)
        self._motion = LaggedSignals(self.layout, plant.half_width, rate, plant.late, jitters)
        self._along = AlongMotion(plant, rate)
        self._drives = [DriveChanges() for _ in range(self.layout.motions[0])]
        self._bands = [DriveBands() for _ in self._drives[:1]]
        self._stops = [DriveStops() for _ in self._drives]
        self.remainder_size = len(self.layout.motions) + self._along.hidden
        self._corner, self._rate = plant.corner, rate
        self.follow(remainder)

    def follow(self, remainder: RemainderSection) -> None:
        """Use another remainder from the next sample, which must be the first after a start."""
        # A remainder without weights is none, and its centre no mean of the hidden states.
        usual = np.array(remainder.centre[len(self.layout.motions) :])
        self._along.follow(usual if np.any(remainder.weights) else None)
        self._high_passed = HighPassed(self._corner, self._rate, remainder)

    def update(self, signals: FloatArray, code: Codes) -> Observed:
        """The next samples, shape (n, channels) in the layout's order."""
        columns, state, steps = self._motion.update(signals, code)
        steady = steps.known
        inputs = self.layout.inputs
        rows, measured = columns[:, :inputs], columns[:, inputs]
        disagreement = columns[:, inputs + 2] - columns[:, inputs + 1]
        predicted = self._along.update(
            rows, np.array(np.hsplit(columns[:, inputs + 3 :], 2)), steps.moved, state, steps.moves
        )
        raw = np.column_stack(
            [
                measured - predicted.output, *map(predicted.change, UNIT_FRICTION),
                predicted.output, disagreement, measured,
                *map(predicted.change, WITH_OTHER_INPUTS),
            ]
        )  # fmt: skip
        z, *changed = (
            _arguments(rows, predicted.states[:, run], self.layout)
            for run in (Run.PLAIN, *WITH_OTHER_INPUTS)
        )
        judged = self._high_passed.update(raw, z, np.stack(changed), state)
        unsure = steps.unsure * judged[:, LATE_UNIT]
        judged = np.column_stack([judged, unsure, predicted.change(Run.DRY), steps.jitters])
        drives = [own.update(signals[:, place], code) for place, own in enumerate(self._drives)]
        for own in drives:
            steady &= ~own.changed
        for place, stops in enumerate(self._stops):
            steady &= ~stops.update(signals[:, place], code)
        pace = drives[0].pace if drives else np.zeros(code.size)
        energies = [own.update(signals[:, 0], code) for own in self._bands]
        bands = energies[0] if energies else np.zeros((code.size, BANDS))
        return Observed(state, rows, measured, predicted, judged, steady, pace, bands, z)


def _arguments(rows: FloatArray, hidden: FloatArray, layout: Layout) -> FloatArray:
    """Motion and hidden states, the arguments of the remainder, shape (n, signals)."""
    return np.ascontiguousarray(np.hstack([rows[:, list(layout.motions)], hidden]))

"""Samples at which a sensor is at the end of its range: a flat top in a reading that else varies.

What the sensor does not show there counts as an error of the model, and begins its windows. A slow
signal of coarse steps stands still everywhere, a machine at rest reads zero, and one that is not
driven need not move; none of them is meant.
"""

from collections.abc import Iterator

import numpy as np

from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.units import unit_of
from rigwatch.workbench.compare import Bench

RUN = 5
"""Samples in a row at the extreme that are no coincidence."""
STILL = 0.2
"""Share of samples elsewhere that equal the one before, up to which a reading varies."""
SAID = (
    "{name}: {count} samples in runs of {run} and more stand at exactly {value:.6g} {unit}, its"
    " {which}, while the inputs change; if the sensor's range ends there, leave them empty in the"
    " log: what it does not show counts as error"
)


def ends_of_range(bench: Bench) -> list[str]:
    """A remark on each output that stands at an extreme, as at the end of a sensor's range."""
    parts = [*_parts(bench.data.train), *_parts(bench.data.held_out)]
    said = []
    for column, (name, own) in enumerate(bench.study.model.outputs.items()):
        series = [(inputs, outputs[:, column]) for inputs, outputs in parts]
        for which, extreme in (("largest", np.nanmax), ("smallest", np.nanmin)):
            value = float(extreme(np.concatenate([each for _, each in series])))
            count = _standing(series, value) if value else 0
            if count:
                unit = own.shown or own.unit
                said.append(
                    SAID.format(
                        name=name, count=count, run=RUN, value=unit_of(unit).from_si(value),
                        unit=unit, which=which,
                    )
                )  # fmt: skip
    return said


def _parts(recording: Recording) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Inputs and outputs of each of the concatenated recordings."""
    return ((recording.inputs[part], recording.outputs[part]) for part in recording.slices)


def _standing(series: list[tuple[FloatArray, FloatArray]], value: float) -> int:
    """Samples that stand at a value in runs while the inputs change; 0 if others stand as well."""
    count, still, moving = 0, 0, 0
    for inputs, reading in series:
        at = reading == value
        for run in _runs(at):
            count += run.stop - run.start if np.any(np.ptp(inputs[run], axis=0)) else 0
        beside = ~(at[1:] | at[:-1])
        still += int(np.sum(beside & (reading[1:] == reading[:-1])))
        moving += int(np.sum(beside))
    return count if still <= STILL * max(moving, 1) else 0


def _runs(at: BoolArray) -> Iterator[slice]:
    """Runs of at least `RUN` true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], at.astype(np.int8), [0]])))
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if stop - start >= RUN:
            yield slice(start, stop)

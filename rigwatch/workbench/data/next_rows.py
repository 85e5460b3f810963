"""Inputs of which a row has the value of the interval that ends there.

A loop that reads its sensors, writes a row and only then computes its next command has in that row
the command that has acted since the row before. A simulation expects the value that acts from the
row on, which is that of the next row.
"""

from collections.abc import Collection
from dataclasses import replace

from rigwatch.physics.engine.equations import Model
from rigwatch.physics.engine.fit import Recording


def with_next_rows(model: Model, recording: Recording, names: Collection[str]) -> Recording:
    """The recording with the next row's values of some inputs; the last of each part stays.

    Args:
        model: names the columns of the recording's inputs.
        recording: as read.
        names: of the inputs.
    """
    columns = [index for index, name in enumerate(model.inputs) if name in names]
    if not columns:
        return recording
    inputs = recording.inputs.copy()
    for column in columns:
        for part in recording.slices:
            inputs[part.start : part.stop - 1, column] = inputs[part.start + 1 : part.stop, column]
    return replace(recording, inputs=inputs)

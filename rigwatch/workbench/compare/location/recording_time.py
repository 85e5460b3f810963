"""The time of a sample in its own recording: the training recordings are fitted concatenated."""

import numpy as np

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.workbench.compare.preparation import Bench
from rigwatch.workbench.study import Span


def recording_name(bench: Bench, at: int) -> str:
    """The name of a training recording, with its beginning where several are of one session."""
    span = _span(bench, at)
    if span is None:
        return f"recording {at + 1}"
    several = sum(other.session == span.session for other in bench.study.file.train) > 1
    return f"{span.session} from {span.start:.6g} s" if several else span.session


def recording_time(bench: Bench, rows: IntArray) -> tuple[IntArray, FloatArray]:
    """The training recording of each sample, counted from 0, and the time in its session.

    Args:
        bench: the study.
        rows: sample numbers, counted through all training recordings.

    Returns:
        Two arrays of the shape of `rows`; the times in s.
    """
    train = bench.data.train
    begins = np.array([part.start for part in train.slices], np.int64)
    numbers = np.searchsorted(begins, rows, side="right") - 1
    spans = [_span(bench, at) for at in range(len(begins))]
    starts = np.array([span.start if span else 0.0 for span in spans])
    spacings = np.array(train.own_spacings)
    return numbers, starts[numbers] + (rows - begins[numbers]) * spacings[numbers]


def _span(bench: Bench, at: int) -> Span | None:
    """The section of a training recording in the study; None if they are in memory alone."""
    file = bench.study.file
    spans = file.train if bench.study.model.presence is None else (*file.train, *file.healthy)
    return spans[at] if len(spans) == len(bench.data.train.slices) else None

"""Names a wrong drive where equations predict the motion, by trying others in its place.

    departed, or beyond the known motion
      └─▶ the scheme on the drive times -1, 10, 0.1, 1000, 0.001
            └─▶ windows of one second ─▶ one explains two in a row ─▶ `wiring_drive`

Along the measured motion the equations predict more than what the drive does, so that sizes of
accelerations cannot be compared as with a transfer function (`monitor.wiring`). A drive explains a
window in which the rig is healthy with it, and in which the drive's part of the prediction stands
out of what is left: one that does next to nothing would also explain a rig that is stuck.

As the wiring check it passes with the first window that the drive itself explains, until the device
or the monitor starts again: a drive that changes later is a fault of the rig. Trials take a part of
the time only, however long the rig departs.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from monitor.model import EquationsPlant, RigModel
from monitor.observer import equations_of
from monitor.pipeline.observer_pipeline import ObserverMonitor
from monitor.pipeline.result import Result
from monitor.signals import Condition, above
from monitor.signals import conditions as kinds
from monitor.wiring import DRIVE, DRIVE_GAIN, FAILURES, window_samples
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.messages import SampleBlock, cut

FACTORS = (-1.0, 10.0, 0.1, 1000.0, 0.001)
"""Of the drive as it is measured: reversed, or in a unit that is ten or a thousand times off."""
STANDS_OUT = 3.0
"""Ratio of the drive's part of the predicted acceleration to what is left from which the motion is
the drive's: it follows the drive by its factor within a third.
"""
LONGEST, PAUSE = 20.0, 60.0
"""Length of a trial, and the least time from its end to the next one [s]."""


class DriveTrial:
    """The trials of one rig.

    Args:
        model: with equations of one input.
    """

    def __init__(self, model: RigModel) -> None:
        self._accepted = DRIVE in model.accepted_wiring
        self._length = window_samples(model.sample_rate)
        self._longest, self._pause = (round(s * model.sample_rate) for s in (LONGEST, PAUSE))
        self._tried = [_Tried(factor, model, self._length) for factor in FACTORS]
        self._own = _Windows(self._length)
        self._boot = self._next = -1
        self._failed = 0.0
        self._restart()

    def adopt(self, model: RigModel) -> None:
        """Go on with another model of the same equations, and with what is accepted by now."""
        self._accepted = DRIVE in model.accepted_wiring
        for one in self._tried:
            one.adopt(model)
        self._restart(0.0 if self._accepted else self._failed)

    def _restart(self, failed: float = 0.0) -> None:
        """Begin anew; a drive that was found to be wrong may stay so."""
        self._passed, self._failed = self._accepted, failed
        self._since_begin, self._since_end = -1, self._pause
        self._forget()

    def _forget(self) -> None:
        """The next sample does not follow the last one: windows begin anew."""
        for windows in (self._own, *(one.windows for one in self._tried)):
            windows.clear()
        self._agreed, self._factor = 0, 0.0

    def update(
        self, block: SampleBlock, result: Result
    ) -> tuple[BoolArray | None, tuple[Condition, ...]]:
        """Whether the drive counts as wrong at each sample, shape (n,), and the condition.

        None once it has passed.

        Args:
            block: new samples; a gap before it discards the windows.
            result: what the scheme makes of them.
        """
        if block.boot != self._boot:
            self._restart()
        elif block.seq != self._next:
            self._forget()
        self._boot, self._next = block.boot, block.seq + len(block)
        if self._passed:
            return None, ()
        wrong = np.arange(len(block)) >= self._first_failed(block, result)
        if not self._failed:
            return wrong, ()
        value = np.full(len(block), self._failed)
        return wrong, (above(DRIVE, wrong, value, DRIVE_GAIN),)

    def _first_failed(self, block: SampleBlock, result: Result) -> int:
        """The first sample at which the drive counts as wrong; the block's length if none."""
        if self._failed:
            return 0
        n = len(block)
        passed = next((end for end, left in self._own.add(result) if np.isfinite(left)), n)
        first = 0
        while first < passed:
            first = self._begin(result, first)
            if first >= passed:
                break
            end = min(passed, first + self._longest - self._since_begin)
            failed = self._try(cut(block, first, end))
            if self._failed:
                return first + failed
            first = end
            if self._since_begin == self._longest:
                self._since_begin, self._since_end = -1, 0
        self._passed = passed < n
        return n

    def _begin(self, result: Result, first: int) -> int:
        """Where the present trial goes on, or a new one begins; the block's length if nowhere."""
        if self._since_begin >= 0:
            return first
        wrong = _departed(result) | _beyond(result)
        at = np.arange(len(wrong))
        waited = at - first + self._since_end
        begins = np.flatnonzero(wrong & (at >= first) & (waited >= self._pause))
        if not begins.size:
            self._since_end += len(wrong) - first
            return len(wrong)
        self._since_begin, self._agreed = 0, 0
        for one in self._tried:
            one.begin()
        return int(begins[0])

    def _try(self, block: SampleBlock) -> int:
        """Run the trial along a block; the sample at which a drive is found, if one is."""
        self._since_begin += len(block)
        found = [dict(one.explained(block)) for one in self._tried]
        for end in sorted(set(chain(*found))):
            left = [one.get(end, np.inf) for one in found]
            best = int(np.argmin(left))
            factor = FACTORS[best] if np.isfinite(left[best]) else 0.0
            self._agreed = (self._agreed + 1 if factor == self._factor else 1) if factor else 0
            self._factor = factor
            if self._agreed == FAILURES:
                self._failed = factor
                return end
        return len(block)


def drive_trial(model: RigModel) -> DriveTrial | None:
    """The trials of a model with equations; None if they have another number of inputs than one.

    Raises:
        ModelError: its equations are invalid.
    """
    assert isinstance(model.plant, EquationsPlant)
    return DriveTrial(model) if len(equations_of(model.plant).inputs) == 1 else None


class _Tried:
    """The scheme on the drive times a factor.

    Attributes:
        windows: of its results.
    """

    def __init__(self, factor: float, model: RigModel, length: int) -> None:
        self._factor, self._model = factor, model
        self._scheme, self.windows = ObserverMonitor(model), _Windows(length)

    def adopt(self, model: RigModel) -> None:
        self._model = model

    def begin(self) -> None:
        self._scheme.adopt(self._model)
        self.windows.clear()

    def explained(self, block: SampleBlock) -> Iterator[tuple[int, float]]:
        """The windows that end in a block, see `_Windows.add`."""
        result = self._scheme.update(self._driven(block))
        return self.windows.add(result) if result is not None else iter(())

    def _driven(self, block: SampleBlock) -> SampleBlock:
        (drive,) = self._scheme.inputs
        columns = tuple(
            replace(column, values=self._factor * column.values) if column.name == drive else column
            for column in block.channels
        )
        return replace(block, channels=columns)


class _Windows:
    """Windows of a scheme's results.

    Args:
        length: of a window [samples].
    """

    def __init__(self, length: int) -> None:
        self._length = length
        self.clear()

    def clear(self) -> None:
        """The next sample does not follow the last one."""
        self._rows: list[FloatArray] = []

    def add(self, result: Result) -> Iterator[tuple[int, float]]:
        """For each window that ends in a result, its last sample and what its drive leaves.

        That is the root mean square of the residual's change [m/s^2], infinite if the drive does
        not explain the window.
        """
        assert result.drive is not None
        change = result.estimates.column("change").values
        healthy = (result.estimates.column("armed").values > 0.0) & ~_departed(result)
        rows = np.column_stack([change, result.drive, healthy])
        begin = 0
        while begin < len(rows):
            end = min(len(rows), begin + self._length - sum(map(len, self._rows)))
            self._rows.append(rows[begin:end])
            begin = end
            if sum(map(len, self._rows)) == self._length:
                yield end - 1, _left(np.concatenate(self._rows))
                self.clear()


def _left(window: FloatArray) -> float:
    change, drive, healthy = window.T
    left = float(np.sqrt(np.mean(change**2)))
    explains = healthy.all() and np.sqrt(np.mean(drive**2)) >= STANDS_OUT * left
    return left if explains else np.inf


def _departed(result: Result) -> BoolArray:
    return _active(result, kinds.DEPARTURE)


def _beyond(result: Result) -> BoolArray:
    return _active(result, kinds.NOT_JUDGED)


def _active(result: Result, name: str) -> BoolArray:
    found = next(one for one in result.conditions if one.name == name)
    return np.asarray(found.active, np.bool_)

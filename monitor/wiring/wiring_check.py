"""Checks the wiring over the first seconds of motion, before anything is judged.

    samples ─▶ windows of one second ─▶ motion ratio ─▶ drive ratio ─▶ passed
                                             └───────────────┴▶ failed, after two windows in a row

The drive is compared where a transfer function predicts the acceleration from it, without the
reference, which hides a difference once it is learned. One good window passes until the device or
the monitor starts again. After a failure nothing is judged until then: a reference learned with
wrong wiring would count as healthy. From the first bad window on nothing is judged either, until a
good one; it takes the second to be told. What a person has accepted, which the model says, passes.
"""

from itertools import pairwise
from typing import Literal

import numpy as np

from monitor.model import RigModel, TransferPlant
from monitor.signals import Condition, above, usable
from monitor.wiring.drive_ratio import ModelledDrive, drive_ratio
from monitor.wiring.motion_ratio import MotionRatio, motion_ratio
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.messages import SampleBlock, cut
from rigwatch.wire.wiring_names import WIRING, Wiring

WINDOW = 1.0
"""Length of a window [s]."""
FAILURES = 2
"""Windows in a row that must fail."""
GAIN, PHASE = 3.0, 60.0
"""Largest factor and phase [deg] that sensors which show the same motion may differ by."""
REVERSED = 15.0
"""Largest deviation of a reversed sensor's phase from 180° [deg]; beyond that, swapped
channels are equally likely.
"""
DRIVE_GAIN = 5.0
"""Largest factor by which a rig may answer its drive otherwise than its model does: other drives,
friction and faults leave 0.55 to 1.4 on the simulated rig and on one simulated by others; units
differ by ten or more.
"""
SIGN, SCALE, SWAPPED, DRIVE = WIRING


def window_samples(rate: float) -> int:
    """Length of a window at a rate [Hz], in samples; at least one."""
    return max(1, round(WINDOW * rate))


class WiringCheck:
    """The check of one rig; it does nothing unless one channel is in m and one in m/s^2.

    Args:
        model: of the rig.
        drive: whether the drive is compared, too.
    """

    def __init__(self, model: RigModel, *, drive: bool = True) -> None:
        self._rate, self._channels = model.sample_rate, model.channels
        compared = drive and isinstance(model.plant, TransferPlant)
        self._drive = ModelledDrive(model) if compared else None
        self._noise = model.noise.residual
        self._accepted = frozenset[str](model.accepted_wiring)
        self._length = window_samples(model.sample_rate)
        self._boot = self._next = -1
        self._restart()

    def adopt(self, model: RigModel) -> None:
        """Go on with what is accepted by now; what had failed is checked again for the rest."""
        self._accepted = frozenset[str](model.accepted_wiring)
        if self._failed in self._accepted:
            self._restart()
            self._fails = 1  # in doubt until a window has passed

    def _restart(self) -> None:
        self._passed = self._sensors_agree = False
        self._failed, self._fails = "", 0
        self._forget()
        self._gain = self._phase = self._ratio = np.nan

    def _forget(self) -> None:
        """The next sample does not follow the last one."""
        self._window: list[FloatArray] = []  # stretches of samples
        self._settled = False
        if self._drive is not None:
            self._drive.restart()

    def update(self, block: SampleBlock) -> tuple[BoolArray | None, tuple[Condition, ...]]:
        """Whether the wiring is in doubt or wrong at each sample, shape (n,), and conditions.

        None once it has passed: none of the samples is in doubt.

        Args:
            block: new samples; a gap before it discards the window.
        """
        if block.boot != self._boot:
            self._restart()
        elif block.seq != self._next:
            self._forget()
        self._boot, self._next = block.boot, block.seq + len(block)
        if self._passed:
            return None, ()
        doubted, wrong = np.zeros((2, len(block)), np.bool_)
        wrong[self._first_failed(block, doubted) :] = True
        return doubted | wrong, tuple(
            above(name, wrong & (name == self._failed), np.full(len(block), value), limit)
            for name, value, limit in (
                (SIGN, abs(self._phase), 180 - REVERSED),
                (SCALE, self._gain, GAIN),
                (SWAPPED, abs(self._phase), PHASE),
                (DRIVE, self._ratio, DRIVE_GAIN),
            )
            if self._failed == name
        )

    def has_passed(self, boot: int) -> bool:
        """Whether no sample of a boot is in doubt, as the wiring has passed."""
        return self._passed and boot == self._boot

    def went_on(self, samples: int) -> None:
        """So many samples have followed, none of them in doubt."""
        self._next += samples

    def _first_failed(self, block: SampleBlock, doubted: BoolArray) -> int:
        """The first sample at which the wiring counts as wrong; the block's length if none.

        `doubted` is set where the last window was bad.
        """
        if self._failed:
            return 0
        # One window passes as a rule, so no more of a long block is read than is asked for.
        for begin in range(0, len(block), self._length):
            end = min(begin + self._length, len(block))
            signals = self._signals(cut(block, begin, end))
            if signals is None:
                self._passed = True
                break
            at = self._collect(signals, doubted[begin:end])
            if self._failed:
                return begin + at
            if self._passed:
                break
        return len(block)

    def _collect(self, signals: FloatArray, doubted: BoolArray) -> int:
        """Judge each window that these samples complete, until one passes or the wiring is wrong.

        Returns that window's last sample, if there is one.
        """
        known: BoolArray = np.isfinite(signals[:, :2].sum(axis=1))
        edges: list[int] = (np.flatnonzero(known[1:] != known[:-1]) + 1).tolist()
        for first, last in pairwise([0, *edges, len(known)]):
            if not known[first]:
                doubted[first:last] = self._fails > 0
                self._window = []
                continue
            begin = first
            while begin < last:
                end = min(last, begin + self._length - sum(map(len, self._window)))
                self._window.append(signals[begin:end])
                doubted[begin:end] = self._fails > 0
                begin = end
                if sum(map(len, self._window)) == self._length:
                    self._judge(np.concatenate(self._window))
                    self._window, self._settled = [], True
                    doubted[end - 1] = self._fails > 0
                    if self._passed or self._failed:
                        return end - 1
        return len(signals)

    def _signals(self, block: SampleBlock) -> FloatArray | None:
        """Position, acceleration and, where it is compared, the modelled acceleration.

        NaN where invalid, shape (n, 2 or 3); None without such a pair.
        """
        known = [column for column in block.channels if column.name in self._channels]
        pair = [[c for c in known if c.unit == unit] for unit in ("m", "m/s^2")]
        if any(len(found) != 1 for found in pair):
            return None
        columns = [found[0] for found in pair]
        read = [np.where(usable(c, stuck_counts=True), c.values, np.nan) for c in columns]
        if self._drive is not None:
            read.append(self._drive.update(block))
        return np.stack(read, axis=1)

    def _judge(self, window: FloatArray) -> None:
        found = motion_ratio(window[:, 0], window[:, 1], self._rate)
        if found is None:
            return
        reason: str | None = "" if self._sensors_agree else wrong_wiring(found)
        reason = "" if reason in self._accepted else reason
        self._sensors_agree = not reason
        if self._drive is not None and not reason and DRIVE not in self._accepted:
            reason = self._wrong_drive(window)
        if reason is None:
            self._fails = 0
            return
        self._passed, self._fails = not reason, self._fails + 1 if reason else 0
        if self._fails == FAILURES:
            self._failed, self._gain, self._phase = reason, found.gain, found.phase

    def _wrong_drive(self, window: FloatArray) -> str | None:
        """What is wrong with the drive, "" if nothing is; None if the window cannot tell."""
        # The filter starts from rest: half of the first window is left to it.
        used = window if self._settled else window[self._length // 2 :]
        ratio = drive_ratio(used[:, 1], used[:, 2], self._noise)
        if ratio is None:
            return None
        self._ratio = ratio
        return "" if 1 / DRIVE_GAIN < ratio < DRIVE_GAIN else DRIVE


def wrong_wiring(found: MotionRatio) -> Wiring | Literal[""]:
    """What is wrong with the wiring; empty if it is right."""
    sized, turned = 1 / GAIN < found.gain < GAIN, abs(found.phase)
    if sized and turned > 180 - REVERSED:
        return SIGN
    if turned > PHASE:
        return SWAPPED
    return "" if sized else SCALE

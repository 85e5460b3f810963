"""What every detector is: blocks of samples in, columns and one condition out, state carried
between.

A detector only judges each sample: persistence, latching and naming belong to the alarms. Missing
or invalid samples never reach it: short runs are bridged with the last good value and not judged;
after a long one it restarts (`monitor.signals.admission`).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from monitor.signals import Admission, Condition
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import Column, SampleBlock

Findings = tuple[tuple[Column, ...], tuple[Condition, ...]]
LONGEST_HOLD = 8
"""Longest run of missing or invalid samples that is bridged [1]."""


class Detector(Protocol):
    """The protocol of a detector in addition to the friction scheme."""

    def update(self, block: SampleBlock) -> Findings:
        """Columns to publish and conditions, each as long as the block."""
        ...


@dataclass(frozen=True, slots=True)
class Channels:
    """The channels of a detector.

    Attributes:
        input: drive of the plant, such as "voltage".
        output: output of the model, such as "position".
        acceleration: second derivative of the output; "" if the rig has none.
    """

    input: str = "voltage"
    output: str = "position"
    acceleration: str = "acceleration"


@dataclass(frozen=True, slots=True)
class Series:
    """One published column of a detector over n samples; NaN if not judged."""

    name: str
    unit: str
    values: FloatArray


@dataclass(frozen=True, slots=True)
class Judgement:
    """The result of a detector's kernel over n samples.

    Attributes:
        series: columns to publish.
        value: the judged quantity, NaN if not judged.
        low, high: its limits.
    """

    series: tuple[Series, ...]
    value: FloatArray
    low: FloatArray
    high: FloatArray

    @property
    def active(self) -> NDArray[np.uint8]:
        """1 where the value is outside its limits; 0 where not judged."""
        return ((self.value < self.low) | (self.value > self.high)).astype(np.uint8)


class SampleDetector(ABC):
    """Base of detectors that work sample by sample on a few channels.

    Args:
        condition: name of the condition that it reports.
        channels: names of the channels it needs, in the order of its kernel's columns.
    """

    def __init__(self, condition: str, channels: tuple[str, ...]) -> None:
        self.condition = condition
        self._admission = Admission(channels, channels, LONGEST_HOLD)

    @abstractmethod
    def judge(self, signals: FloatArray, code: NDArray[np.int64]) -> Judgement:
        """Judge consecutive samples.

        Args:
            signals: shape (n, channels), finite, held where not good.
            code: shape (n,), codes of `monitor.signals.admission`.
        """

    def update(self, block: SampleBlock) -> Findings:
        """Columns and the condition over the block; NaN and 0 for samples seen before.

        Raises:
            KeyError: the block lacks a channel.
        """
        admitted = self._admission.admit(block)
        if admitted is None:
            return (), ()
        found = self.judge(admitted.signals, admitted.code)
        skip = admitted.padding

        def over_block(values: FloatArray) -> FloatArray:
            whole = np.full(len(block), np.nan)
            fresh = values[skip:]
            whole[len(block) - len(fresh) :] = fresh
            return whole

        columns = tuple(Column(one.name, one.unit, over_block(one.values)) for one in found.series)
        active = (over_block(found.active.astype(np.float64)) == 1.0).astype(np.uint8)
        limits = over_block(found.low), over_block(found.high)
        return columns, (Condition(self.condition, active, over_block(found.value), *limits),)

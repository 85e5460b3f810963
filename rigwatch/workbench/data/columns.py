"""Channels of a session over equally spaced samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from rigwatch.physics.engine.fit import SAME_SPACING, filled
from rigwatch.physics.transfer import Derivative
from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Columns:
    """Channels over equally spaced samples.

    Attributes:
        dt: time between samples [s].
        values: by channel, each of shape (n,), in SI; NaN for invalid samples.
        units: of the channels as recorded.
        altered: how the samples differ from what was measured, in words.
        passed: frequency up to which signals keep their noise, over the rate: neither low-passed
            nor interpolated away.
        begun: time of the equations at the first sample [s].
        derived: how channels were derived from measured ones; those that were not are missing.
    """

    dt: float
    values: Mapping[str, FloatArray]
    units: Mapping[str, str] = field(default_factory=dict)
    altered: tuple[str, ...] = ()
    passed: float = 0.5
    begun: float = 0.0
    derived: Mapping[str, Derivative] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


def bridged(signal: FloatArray) -> FloatArray:
    """The signal with gaps (NaN) interpolated linearly; unchanged if it has no valid sample."""
    return filled(signal) if np.isfinite(signal).any() else signal


def copies(tables: Mapping[str, Columns]) -> tuple[str, str] | None:
    """Names of the first two recordings that are equal sample by sample; None if all differ.

    Args:
        tables: the recordings by name.
    """
    pairs = combinations(tables, 2)
    return next((pair for pair in pairs if same(tables[pair[0]], tables[pair[1]])), None)


def any_same(some: Sequence[Columns], others: Sequence[Columns]) -> bool:
    """Whether one of the recordings is also among the others."""
    return any(same(one, other) for one in some for other in others)


def same(one: Columns, other: Columns) -> bool:
    """Whether two recordings have the same rate, channels and samples."""
    if len(one) != len(other) or set(one.values) != set(other.values):
        return False
    if abs(one.dt - other.dt) > SAME_SPACING * one.dt:
        return False
    return all(
        np.array_equal(values, other.values[name], equal_nan=True)
        for name, values in one.values.items()
    )

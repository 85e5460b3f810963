"""Recordings for commissioning: in memory, one array per channel."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages import SampleBlock, valid

Role = Literal["chirp", "healthy", "friction"]


@dataclass(frozen=True, eq=False)
class Recording:
    """One commissioning recording without gaps.

    Args:
        role: chirp or multisine without friction; healthy reference; with a known friction fault.
        name: for messages and the model file.
        sample_rate: [Hz].
        channels: values by channel name, SI units, all of shape (n,).
        sha256: hash of the samples.
    """

    role: Role
    name: str
    sample_rate: float
    channels: Mapping[str, FloatArray]
    sha256: str = ""

    def channel(self, name: str) -> FloatArray:
        """The values of a channel.

        Raises:
            ModelError: the recording has no such channel.
        """
        if name not in self.channels:
            raise ModelError(
                f"{self.name}: found channels {', '.join(self.channels)}, expected one {name!r}"
            )
        return self.channels[name]


def recording_of(
    role: Role, name: str, sample_rate: float, channels: Mapping[str, FloatArray]
) -> Recording:
    """A recording from arrays, with its hash.

    Raises:
        ModelError: a value is not finite or the lengths differ.
    """
    arrays = {key: np.ascontiguousarray(value, dtype=np.float64) for key, value in channels.items()}
    if len({value.size for value in arrays.values()}) != 1:
        raise ModelError(f"{name}: found channels of different lengths")
    digest = hashlib.sha256()
    for key, value in arrays.items():
        if not np.all(np.isfinite(value)):
            raise ModelError(f"{name}: channel {key}: found a value that is not finite")
        digest.update(key.encode() + value.tobytes())
    return Recording(role, name, sample_rate, arrays, digest.hexdigest())


def joined(role: Role, name: str, blocks: Iterable[SampleBlock], sample_rate: float) -> Recording:
    """The longest stretch of the blocks without a gap, a new boot or an invalid sample.

    Raises:
        ModelError: there are no samples, or less than a second without a gap.
    """
    best: list[SampleBlock] = []
    stretch: list[SampleBlock] = []
    for block in blocks:
        follows = stretch and (block.boot, block.seq) == (
            stretch[-1].boot,
            stretch[-1].seq + len(stretch[-1]),
        )
        good = all(valid(column.quality).all() for column in block.channels)
        stretch = [*stretch, block] if follows and good else ([block] if good else [])
        if sum(map(len, stretch)) > sum(map(len, best)):
            best = list(stretch)
    if sum(map(len, best)) < sample_rate:
        raise ModelError(f"{name}: found no second of samples without a gap or an invalid one")
    names = [column.name for column in best[0].channels]
    channels = {key: np.concatenate([block.channel(key).values for block in best]) for key in names}
    return recording_of(role, name, sample_rate, channels)

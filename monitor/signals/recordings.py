"""Recordings for commissioning: in memory, one array per channel."""

import hashlib
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages import SampleBlock

Role = Literal["chirp", "healthy", "friction"]
LEAST_S = 5.0
"""Shortest stretch of a recording that is used beside others [s]."""


@dataclass(frozen=True, eq=False)
class Recording:
    """One commissioning recording without gaps.

    Args:
        role: chirp or multisine without friction; healthy reference; with a known friction fault.
        name: for messages and the model file.
        sample_rate: [Hz].
        channels: values by channel name, SI units, all of shape (n,).
        sha256: hash of the samples.
        units: of the channels, as far as known.
    """

    role: Role
    name: str
    sample_rate: float
    channels: Mapping[str, FloatArray]
    sha256: str = ""
    units: Mapping[str, str] = field(default_factory=dict)

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


def recorded(
    role: Role,
    name: str,
    blocks: Iterable[SampleBlock],
    sample_rate: float,
    *,
    needed: Collection[str],
    say: Callable[[str], None] = lambda _: None,
) -> list[Recording]:
    """The stretches of the blocks without a gap, a new boot or an invalid sample, longest first.

    A stretch is left out if it is too short to be commissioned with, unless it is the only one. Of
    a friction recording there is one: its fault sets in once.

    Args:
        role, name, sample_rate: of the recording.
        blocks: its samples.
        needed: channels of the model; other channels are left out.
        say: called with a line for each thing that is left out.

    Raises:
        ModelError: there are no samples, or less than a second in one stretch.
    """
    stretches = _Stretches(needed)
    for block in blocks:
        stretches.add(block)
    found = sorted(stretches.found, key=lambda one: one.count, reverse=True)
    if not found or found[0].count < sample_rate:
        why = f": {stretches.told()}" if stretches.told() else ""
        raise ModelError(f"{name}: found no second of samples without a gap or an invalid one{why}")
    long = [one for one in found if one.count >= LEAST_S * sample_rate] or found[:1]
    used = long[:1] if role == "friction" else long
    if left := stretches.total - sum(one.count for one in used):
        why = f" ({stretches.told()})" if stretches.told() else ""
        whole = f"{stretches.total / sample_rate:.3g} s"
        say(f"{name}: {left / sample_rate:.3g} s of {whole} left out{why}")
    for channel, count in stretches.unneeded.items():
        say(f"{name}: {channel}: {count} invalid samples; the model does not need it")
    return [
        replace(
            recording_of(role, _named(name, one, at, sample_rate), sample_rate, one.values()),
            units=stretches.units,
        )
        for at, one in enumerate(used)
    ]


def _named(name: str, stretch: "_Stretch", at: int, rate: float) -> str:
    return name if at == 0 else f"{name} from {stretch.start / rate:.3g} s"


class _Stretch:
    """Samples without a gap, from the `start`-th of the recording on."""

    def __init__(self, start: int) -> None:
        self.start, self.count = start, 0
        self._parts: dict[str, list[FloatArray]] = {}

    def add(self, block: SampleBlock, names: Iterable[str], first: int, last: int) -> None:
        """Samples `first` to `last`, exclusive, of a block."""
        for name in names:
            self._parts.setdefault(name, []).append(block.channel(name).values[first:last])
        self.count += last - first

    def values(self) -> dict[str, FloatArray]:
        """All values of each channel."""
        return {name: np.concatenate(parts) for name, parts in self._parts.items()}


class _Stretches:
    """Divides blocks at gaps and at invalid samples of the needed channels."""

    def __init__(self, needed: Collection[str]) -> None:
        self._needed = needed
        self.found: list[_Stretch] = []
        self.invalid: Counter[str] = Counter()
        self.unneeded: Counter[str] = Counter()
        self.units: dict[str, str] = {}
        self.total = self.lost = 0
        self._next = (0, -1)
        self._open = False

    def add(self, block: SampleBlock) -> None:
        """The next block."""
        if (block.boot, block.seq) != self._next:
            self._open = False
            if block.boot == self._next[0]:
                self._skip(block.seq - self._next[1])
        self._next = block.boot, block.seq + len(block)
        good = np.ones(len(block), np.bool_)
        names = []
        for column in block.channels:
            here = np.isfinite(column.usable())
            wrong = len(block) - int(here.sum())
            if column.name in self._needed:
                names.append(column.name)
                self.units[column.name] = column.unit
                self.invalid[column.name] += wrong
                good &= here
            elif wrong:
                self.unneeded[column.name] += wrong
        for first, last in _runs(good):
            if first > 0 or not self._open:
                self.found.append(_Stretch(self.total + first))
            self.found[-1].add(block, names, first, last)
        self._open = bool(good[-1])
        self.total += len(block)

    def _skip(self, count: int) -> None:
        """Count lost samples as time of the recording."""
        self.lost += max(0, count)
        self.total += max(0, count)

    def told(self) -> str:
        """The lost samples, and the invalid ones of each channel."""
        lost = [f"{self.lost} lost"] if self.lost else []
        return ", ".join([*lost, *(f"{name}: {n} invalid" for name, n in (+self.invalid).items())])


def _runs(good: BoolArray) -> list[tuple[int, int]]:
    """First and last, exclusive, of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], good, [False])).astype(np.int8)))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]

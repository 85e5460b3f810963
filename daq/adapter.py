"""The adapter protocol: an adapter turns a device into raw blocks, independently of their use.

An adapter's `read` waits for samples and returns them as received: counters may wrap, samples may
repeat or be missing. Everything after that is the same for all devices (`acquisition.py`). An
adapter raises `DeviceError` when the device is gone, and the supervisor reopens it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import IntArray
from rigwatch.wire.errors import DeviceError
from rigwatch.wire.messages import ByteArray


class DeviceBusyError(DeviceError):
    """Another process holds the device."""


@dataclass(frozen=True, slots=True)
class RawBlock:
    """Samples of one boot, in order of arrival.

    Attributes:
        boot: random number that the device draws when it starts.
        seq: shape (n,), sample numbers; may wrap at 2³².
        device_us: shape (n,), the device's clock [µs]; may wrap at 2³².
        codes: shape (n, channels), raw codes, or SI values where `calibrated`.
        arrived_ns: shape (n,), host's monotonic clock when each sample was complete [ns].
        calibrated: whether `codes` are SI values already, as in a recording.
        quality: shape (n, channels), flags of a recording; empty if there are none.
    """

    boot: int
    seq: IntArray
    device_us: IntArray
    codes: NDArray[Any]
    arrived_ns: IntArray
    calibrated: bool = False
    quality: ByteArray = field(default_factory=lambda: np.zeros((0, 0), np.uint8))

    def __len__(self) -> int:
        return len(self.seq)


class Known(Protocol):
    """The device of a rig, which an adapter compares with the one that answers."""

    @property
    def expected(self) -> str:
        """What the rig's device tells of itself; empty if it is not known."""

    def admits(self, identity: str) -> bool:
        """Whether a device that tells this is the rig's; empty for one that tells nothing."""


class Adapter(Protocol):
    """One device: opened, read, and after an error closed and reopened.

    An adapter whose device tells who it is may have a method `check_against(known: Known)`, called
    before the device is opened: the samples of a device that is not admitted must not be returned.

    Attributes:
        clock_rate: device microseconds per host microsecond; 1 except in replays.
        at_once: (optional) whether `read(0)` of an open device never waits for it, so that one
            thread may read many.
    """

    clock_rate: float

    def open(self) -> None:
        """Open the device.

        Raises:
            DeviceError: it is absent, in use, or does not match the configuration.
        """

    def read(self, timeout: float) -> Sequence[RawBlock]:
        """Samples available now or within `timeout` [s]; an empty list if there are none.

        Raises:
            DeviceError: the device is gone.
            ModbusError: it answers wrongly.
        """

    def close(self) -> None:
        """Close the device; does nothing if it is closed."""

    def counters(self) -> Mapping[str, float]:
        """Counters since the adapter was created, such as `crc_errors`, for the health message."""


def picked(raw: RawBlock, index: Sequence[int] | slice) -> RawBlock:
    """A selection of a block's samples, in order."""
    if not isinstance(index, slice) and len(index) == len(raw):
        return raw
    span = index if isinstance(index, slice) else list(index)
    return replace(
        raw,
        seq=raw.seq[span],
        device_us=raw.device_us[span],
        codes=raw.codes[span],
        arrived_ns=raw.arrived_ns[span],
        quality=raw.quality[span] if len(raw.quality) else raw.quality,
    )

"""What an adapter is: it turns a device into raw blocks and knows nothing of what becomes of them.

An adapter's `read` waits for samples and returns them as they came: with wrapping counters, perhaps
twice, perhaps with holes. Everything after that is the same for all devices (`acquisition.py`). An
adapter raises `DeviceError` when the device has gone away and the supervisor opens it again.
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
    """The device is there and another process has it."""


@dataclass(frozen=True, slots=True)
class RawBlock:
    """Samples of one boot in the order in which they came.

    Attributes:
        boot: drawn by the device at its start.
        seq: shape (n,), sample numbers; may wrap at 2³².
        device_us: shape (n,), the device's clock [µs]; may wrap at 2³².
        codes: shape (n, channels), raw codes, or SI values where `calibrated`.
        arrived_ns: shape (n,), host's monotonic clock when each was complete [ns].
        calibrated: `codes` are SI values already, as in a recording.
        quality: shape (n, channels), flags of a recording; empty where there are none.
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


class Adapter(Protocol):
    """One device. Opened, read, and after an error closed and opened again.

    Attributes:
        clock_rate: device microseconds in a microsecond of the host; 1 but for replays.
    """

    clock_rate: float

    def open(self) -> None:
        """Open the device.

        Raises:
            DeviceError: it is not there, in use, or not what the configuration says.
        """

    def read(self, timeout: float) -> Sequence[RawBlock]:
        """Samples that are there, or that come within `timeout` [s]; none where none came.

        Raises:
            DeviceError: the device has gone away.
            ModbusError: it answers, but not as it should.
        """

    def close(self) -> None:
        """Close the device; harmless when it is closed."""

    def counters(self) -> Mapping[str, float]:
        """Figures since the adapter was made, such as `crc_errors`, for the health message."""


def picked(raw: RawBlock, index: Sequence[int] | slice) -> RawBlock:
    """Some of a block's samples, in order."""
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

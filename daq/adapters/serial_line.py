"""Reads frames from a serial line: bytes in, raw blocks out.

    port (device file or glob) ── SerialPort ──bytes──▶ FrameDecoder ──frames──▶ RawBlock

The port is waited for, so that a frame is passed on as soon as its last byte arrives.
A test passes its own transport.
"""

import errno
import glob
import os
import time
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import Protocol, TypeVar

import numpy as np
import serial

from daq.adapter import DeviceBusyError, RawBlock
from daq.adapters.frame_run import read_run
from rigwatch.wire.device import Frame, FrameDecoder
from rigwatch.wire.errors import DeviceError
from rigwatch.wire.host import ready_to_read
from rigwatch.wire.rig_config import ChannelSection, SerialSection

_CHUNK = 4096


class ByteSource(Protocol):
    """A source of bytes."""

    def open(self) -> None:
        """Open the line; raises `DeviceError` if it is absent or in use."""

    def read(self, timeout: float) -> bytes:
        """The bytes available within `timeout` [s]; raises `DeviceError` if the line is gone."""

    def close(self) -> None:
        """Close the line; does nothing if it is closed."""


class SerialPort:
    """A serial device or pty, opened exclusively.

    Args:
        port: device file or glob pattern; the first match that opens is taken.
        baud: baud rate.
    """

    def __init__(self, port: str, baud: int) -> None:
        self.port = port
        self.baud = baud
        self._serial: serial.Serial | None = None
        self._fd = -1

    def open(self) -> None:
        """Open the first match of the pattern.

        Raises:
            DeviceBusyError: the matching device is in use by another process.
            DeviceError: nothing matches, or the match cannot be opened.
        """
        self.close()
        self._serial = first_that_opens(
            self.port, lambda path: serial.Serial(path, self.baud, timeout=0, exclusive=True)
        )
        self._fd = self._serial.fileno()

    def read(self, timeout: float) -> bytes:
        """The bytes available within `timeout` [s].

        Raises:
            DeviceError: the other end closed the line, or it was unplugged.
        """
        if self._serial is None:
            raise DeviceError(f"{self.port} is not open")
        try:
            fd = self._fd
            data = os.read(fd, _CHUNK) if timeout <= 0.0 else None
            if not data:  # which does not tell whether the line was closed
                data = os.read(fd, _CHUNK) if ready_to_read((fd,), timeout) else None
        except BlockingIOError:
            return b""
        except OSError as error:
            raise DeviceError(f"{self.port}: {_plain(error)}") from error
        if data == b"":
            raise DeviceError(f"{self.port}: the line was closed at its other end")
        return data or b""

    def close(self) -> None:
        """Close the device; does nothing if it is closed."""
        if self._serial is not None:
            self._serial.close()
            self._serial = None


P = TypeVar("P")


def first_that_opens(pattern: str, opened: Callable[[str], P]) -> P:
    """`opened(path)` of the first device file that matches `pattern` and opens.

    Raises:
        DeviceBusyError: the matching device is in use by another process.
        DeviceError: nothing matches, or the match cannot be opened.
    """
    paths = sorted(glob.glob(pattern)) if glob.has_magic(pattern) else [pattern]  # noqa: PTH207
    refusals: list[str] = []
    kind = DeviceError
    for path in paths:
        try:
            return opened(path)
        except (OSError, ValueError) as error:
            kind = DeviceBusyError if _busy(error) else kind
            refusals.append(f"{path}: {_plain(error)}")
    raise kind("; ".join(refusals) or f"no device matches {pattern}")


def _busy(error: Exception) -> bool:
    return "exclusively lock" in str(error) or getattr(error, "errno", None) == errno.EBUSY


def _plain(error: Exception) -> str:
    if _busy(error):
        return "in use by another process"
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)


class SerialAdapter:
    """Frames of a serial line as raw blocks, one block per read.

    Args:
        source: the line.
        channels: number of channels a frame must have.
        clock: monotonic time [ns].

    Attributes:
        channels: number of channels of a frame.
    """

    clock_rate = 1.0
    at_once = True

    def __init__(
        self, source: ByteSource, channels: int, clock: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self._source = source
        self._clock = clock
        self.channels = channels
        self._decoder = FrameDecoder()
        self._bytes = 0
        self._received: tuple[bytes, int] | None = None
        self._rest = b""
        read_run(b"", channels, 0)  # compiled before the first sample arrives

    def open(self) -> None:
        """Open the line; drops an unfinished frame from before."""
        self._decoder.forget()
        self._received = None
        self._source.open()

    def read(self, timeout: float) -> Sequence[RawBlock]:
        """The samples of complete frames; waits up to `timeout` [s] for the first byte.

        Raises:
            DeviceError: the line is gone, or frames have a different number of channels.
        """
        data, arrived = self._received or self._receive(timeout)
        self._received = None
        run = self._decoder.feed_run(data, lambda whole: read_run(whole, self.channels, arrived))
        if run is not None:
            return [run]
        frames = self._decoder.feed(data)
        for frame in frames:
            if len(frame.codes) != self.channels:
                found = f"the device sends {len(frame.codes)} channels"
                raise DeviceError(f"{found}, the configuration has {self.channels}")
        return [_block(list(run), arrived) for _, run in groupby(frames, lambda f: f.boot)]

    def receive(self) -> tuple[bytes, int] | None:
        """Read what has come; whole frames among it, and when the last byte arrived [ns].

        Whoever has read all of the frames calls `took`; otherwise the next `read` returns them.

        Returns:
            None if there are none, or only `read` may take them.

        Raises:
            DeviceError: the line is gone.
        """
        data, arrived = self._received = self._receive(0.0)
        found = self._decoder.completed(data)
        if found is None:
            return None
        whole, self._rest = found
        return whole, arrived

    def took(self, frames: int) -> None:
        """Count so many frames of those that `receive` has returned, which were all."""
        self._decoder.took(frames, self._rest)
        self._received = None

    def _receive(self, timeout: float) -> tuple[bytes, int]:
        data = self._source.read(timeout)
        self._bytes += len(data)
        return data, self._clock()

    def close(self) -> None:
        """Close the line."""
        self._source.close()

    def counters(self) -> Mapping[str, float]:
        """Losses on the line, in frames and bytes."""
        decoder = self._decoder
        return {
            "bytes": self._bytes,
            "good_frames": decoder.good,
            "crc_errors": decoder.crc_errors,
            "skipped_bytes": decoder.skipped_bytes,
            "resyncs": decoder.resyncs,
        }


def _block(frames: list[Frame], arrived: int) -> RawBlock:
    return RawBlock(
        boot=frames[0].boot,
        seq=np.array([frame.seq for frame in frames], np.int64),
        device_us=np.array([frame.device_us for frame in frames], np.int64),
        codes=np.array([frame.codes for frame in frames], np.int16),
        arrived_ns=np.full(len(frames), arrived, np.int64),
    )


def from_section(section: SerialSection, channels: tuple[ChannelSection, ...]) -> SerialAdapter:
    """Entry point `serial` of the group `rigwatch.adapters`."""
    return SerialAdapter(SerialPort(section.port, section.baud), len(channels))

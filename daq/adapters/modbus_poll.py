"""Polls a Modbus device: the header, then the slots not read yet.

    32 times a second:  header ─▶ how many samples are new ─▶ their slots ─▶ RawBlock

The same for TCP and RTU, which differ in the `Registers` passed in. A failed poll is counted. What
it has read until then counts, and the rest stays in the device's ring for the next one; after
several polls in a row that read nothing the client reconnects.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np

from daq.adapter import Known, RawBlock
from rigwatch.wire.device import HEADER_LENGTH, Header, WordOrder, decode_header, decode_slots
from rigwatch.wire.errors import DeviceError, ModbusError

_FAILURES = 3
_MARGIN = 8
"""Slots about to be overwritten, which are not read: twice as many after a poll of a full ring that
found them overwritten, as a device takes on samples while it is asked.
"""
_U32 = 1 << 32


class Registers(Protocol):
    """Input registers of one unit."""

    def open(self) -> None:
        """Connect; raises `DeviceError` if that fails."""

    def read(self, address: int, count: int) -> list[int]:
        """`count` registers; raises `ModbusError`, or `DeviceError` if the link is gone."""

    def close(self) -> None:
        """Close; does nothing if closed."""


class Who(Protocol):
    """Checks which device answers.

    Attributes:
        known: the rig's device, if it is to be checked.
    """

    known: Known | None

    def check(self) -> None:
        """Raises `RefusedError` if another device answers, `ModbusError` if it cannot be told."""


class RefusedError(ModbusError):
    """The device answers with an exception code that retrying does not cure."""


class ModbusAdapter:
    """Reads the buffered samples of a Modbus device.

    Args:
        registers: the device.
        channels: number of channels it must have.
        polls: polls per second.
        order: which 16-bit half of a 32-bit value comes first.
        who: asked when the device is connected and when it has started anew.
        clock: monotonic time [ns].
        sleep: waits for a number of seconds.

    Attributes:
        trouble: why the last failed poll failed.
    """

    clock_rate = 1.0

    def __init__(
        self,
        registers: Registers,
        channels: int,
        polls: float = 32.0,
        order: WordOrder = "big",
        *,
        who: Who | None = None,
        clock: Callable[[], int] = time.monotonic_ns,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._registers = registers
        self._channels = channels
        self._period_ns = round(1e9 / polls)
        self._order: WordOrder = order
        self._who = who
        self._clock = clock
        self._sleep = sleep
        self._next_poll = 0
        self._boot: int | None = None
        self._next_seq = 0
        self._failed = 0
        self._backwards = 0
        self._margin, self._full = _MARGIN, False
        self._counts = Counter({"polls": 0, "failed_polls": 0})
        self.trouble = ""

    def check_against(self, known: Known) -> None:
        """Check from now on that the device is the one that is known."""
        if self._who is not None:
            self._who.known = known

    def open(self) -> None:
        """Connect, and check identification, word order and channels.

        Raises:
            DeviceError: the device cannot be reached.
            ModbusError: it does not match the configuration.
        """
        self._registers.open()
        self._failed = 0
        self._next_poll = self._clock()
        self._header()
        self._check()

    def read(self, timeout: float) -> Sequence[RawBlock]:
        """The new samples at the next poll, if it is due within `timeout` [s].

        Raises:
            DeviceError: the link is gone, or several polls in a row failed without a sample.
            ModbusError: the device refuses, or does not match the configuration.
        """
        wait = (self._next_poll - self._clock()) * 1e-9
        self._sleep(min(max(wait, 0.0), timeout))
        if wait > timeout:
            return ()
        self._next_poll = max(self._next_poll + self._period_ns, self._clock())
        self._counts["polls"] += 1
        blocks: list[RawBlock] = []
        try:
            self._poll(blocks)
        except (ModbusError, DeviceError) as error:
            self._fail(error, has_read=bool(blocks))
        else:
            self._failed, self._margin = 0, _MARGIN
        return blocks

    def close(self) -> None:
        """Close the connection."""
        self._registers.close()

    def counters(self) -> Mapping[str, float]:
        """Number of polls, and of failed polls."""
        return dict(self._counts)

    def _check(self) -> None:
        if self._who is not None:
            self._who.check()

    def _fail(self, error: ModbusError | DeviceError, *, has_read: bool) -> None:
        """Count a failed poll; an error that lasts is raised by the next one that reads nothing."""
        self._counts["failed_polls"] += 1
        self.trouble = str(error)
        self._failed = 0 if has_read else self._failed + 1
        if has_read:
            return
        if self._full:
            self._margin *= 2
        if isinstance(error, RefusedError | DeviceError):
            raise error
        if self._failed >= _FAILURES:
            raise DeviceError(f"{self._failed} polls in a row failed, the last: {error}") from error

    def _header(self) -> Header:
        header = decode_header(self._registers.read(0, HEADER_LENGTH), self._order)
        if header.channels != self._channels:
            found = f"the device has {header.channels} channels"
            raise RefusedError(f"{found}, the configuration has {self._channels}")
        return header

    def _poll(self, blocks: list[RawBlock]) -> None:
        """Read the new samples into `blocks`, which has those read so far if it fails."""
        self._full = False
        header = self._header()
        if self._boot not in (None, header.boot):
            self._check()  # on a line that stays open another device may answer now
        new = self._new(header)
        arrived = self._clock()
        while new > 0:
            count = min(new, header.slots_a_read, header.slots - self._next_seq % header.slots)
            blocks.append(self._slots(header, count, arrived))
            self._next_seq = (self._next_seq + count) % _U32
            new -= count

    def _new(self, header: Header) -> int:
        """Samples to read, from `_next_seq` on."""
        if self._boot is None:
            self._next_seq = (header.samples - min(header.samples, 1)) % _U32
        elif header.boot != self._boot:
            self._next_seq = 0
        self._boot = header.boot
        new = (header.samples - self._next_seq) % _U32
        if new > _U32 // 2:
            self._backwards += 1
            if self._backwards < _FAILURES - 1:
                raise ModbusError("the device's count went back: a late reply, or a new count")
            new = header.samples
        self._backwards = 0
        readable = max(header.slots - min(self._margin, header.slots // 2), 1)
        self._full = new > readable
        new = min(new, readable)
        self._next_seq = (header.samples - new) % _U32
        return new

    def _slots(self, header: Header, count: int, arrived: int) -> RawBlock:
        first = self._next_seq
        found = self._registers.read(header.address(first), count * header.slot_length)
        device_us, codes = decode_slots(found, first, count, header, self._order)
        seq = (first + np.arange(count)) % _U32
        return RawBlock(header.boot, seq, device_us, codes, np.full(count, arrived, np.int64))

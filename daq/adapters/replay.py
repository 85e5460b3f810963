"""Plays a recorded session in place of a device, at any speed.

Samples arrive when they are due by the device's clock in the recording, calibrated and flagged as
recorded. Where the device started anew its clock did, too: the time of the host tells how much
later that was. Samples keep their recorded sequence numbers; each pass of a loop is a separate
boot.
"""

import math
import time
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from daq.adapter import RawBlock, picked
from rigwatch.wire.errors import DeviceError, SessionError
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.rig_config import ChannelSection, ReplaySection
from rigwatch.wire.session import open_session


class ReplayAdapter:
    """Plays a session.

    Args:
        session: file or folder.
        channels: the channels to deliver, by name, in this order.
        speed: multiple of real time.
        loop: start over at the end.
        clock: monotonic time [ns].
        sleep: waits for a number of seconds.
    """

    def __init__(
        self,
        session: Path | str,
        channels: Sequence[ChannelSection],
        speed: float = 1.0,
        *,
        loop: bool = False,
        clock: Callable[[], int] = time.monotonic_ns,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.clock_rate = speed
        self._session = Path(session)
        self._channels = tuple(channels)
        self._loop = loop
        self._clock = clock
        self._sleep = sleep
        self._turn = 0
        self._blocks: Iterator[SampleBlock] = iter(())
        self._rest: RawBlock | None = None
        self._boot: int | None = None
        self._start_ns = 0
        self._start_us = 0
        self._recorded_ns = 0
        self._played = 0

    def open(self) -> None:
        """Start at the session's first sample.

        Raises:
            DeviceError: the session does not exist or has no samples.
        """
        self._rest = self._first()
        if self._rest is None:
            raise DeviceError(f"{self._session}: no samples to replay")

    def read(self, timeout: float) -> Sequence[RawBlock]:
        """The samples due now or within `timeout` [s].

        Raises:
            DeviceError: the session lacks a channel or has it in another unit.
        """
        if self._rest is None:
            self._sleep(timeout)
            return ()
        wait = (self._due_ns(int(self._rest.device_us[0])) - self._clock()) * 1e-9
        self._sleep(min(max(wait, 0.0), timeout))
        elapsed_us = (self._clock() - self._start_ns) * 1e-3 * self.clock_rate
        due = int(np.searchsorted(self._rest.device_us, self._start_us + elapsed_us, "right"))
        if due == 0:
            return ()
        part = picked(self._rest, slice(0, due))
        self._played += due
        self._rest = picked(self._rest, slice(due, None)) if due < len(self._rest) else None
        if self._rest is None:
            self._rest = self._next() or self._again()
        return (_arrived(part, self._clock()),)

    def close(self) -> None:
        """Stop playing."""
        self._blocks, self._rest = iter(()), None

    def counters(self) -> Mapping[str, float]:
        """Samples played, and passes started."""
        return {"played": self._played, "turns": self._turn + 1}

    def _due_ns(self, us: int) -> int:
        return self._start_ns + math.ceil((us - self._start_us) * 1e3 / self.clock_rate) + 1

    def _opened(self) -> Iterator[SampleBlock]:
        try:
            return open_session(self._session).samples()
        except SessionError as error:
            raise DeviceError(str(error)) from error

    def _next(self) -> RawBlock | None:
        try:
            block = next(self._blocks, None)
        except SessionError as error:
            raise DeviceError(str(error)) from error
        if block is None:
            return None
        raw = self._raw(block)
        if block.boot != self._boot:
            self._begin(block.boot, int(raw.device_us[0]), int(block.t_ns[0]))
        return raw

    def _begin(self, boot: int, us: int, t_ns: int) -> None:
        """Play a boot from now on, or later if there was a break before it."""
        later = 0 if self._boot is None else round((t_ns - self._recorded_ns) / self.clock_rate)
        self._start_ns = max(self._start_ns + later, self._clock())
        self._boot, self._start_us, self._recorded_ns = boot, us, t_ns

    def _first(self) -> RawBlock | None:
        self._blocks, self._boot = self._opened(), None
        return self._next()

    def _again(self) -> RawBlock | None:
        if not self._loop:
            return None
        self._turn += 1
        return self._first()

    def _raw(self, block: SampleBlock) -> RawBlock:
        columns = [self._column(block, channel) for channel in self._channels]
        boot = zlib.crc32(f"{block.boot}/{self._turn}".encode()) if self._turn else block.boot
        n = len(block)
        return RawBlock(
            boot=boot,
            seq=np.arange(block.seq, block.seq + n),
            device_us=block.device_us if len(block.device_us) else block.t_ns // 1000,
            codes=np.stack([column.values for column in columns], axis=1),
            arrived_ns=np.zeros(n, np.int64),
            calibrated=True,
            quality=np.stack([_quality(column, n) for column in columns], axis=1),
        )

    def _column(self, block: SampleBlock, channel: ChannelSection) -> Column:
        found = {column.name: column for column in block.channels}.get(channel.name)
        if found is None:
            names = ", ".join(column.name for column in block.channels)
            raise DeviceError(f"{self._session}: no channel {channel.name!r}, found {names}")
        if found.unit != channel.unit:
            units = f"channel {channel.name!r} is in [{found.unit}]"
            raise DeviceError(f"{self._session}: {units}, expected [{channel.unit}]")
        return found


def _quality(column: Column, n: int) -> np.ndarray:
    return column.quality if len(column.quality) else np.zeros(n, np.uint8)


def _arrived(raw: RawBlock, now_ns: int) -> RawBlock:
    raw.arrived_ns[:] = now_ns
    return raw


def from_section(section: ReplaySection, channels: tuple[ChannelSection, ...]) -> ReplayAdapter:
    """Entry point `replay` of the group `rigwatch.adapters`."""
    return ReplayAdapter(section.session, channels, section.speed, loop=section.loop)

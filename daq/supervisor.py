"""Keeps an adapter open: after an error it is closed and reopened until it works.

The wait between attempts grows from 50 ms to one second, and resets once samples arrive.
"""

import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from daq.adapter import Adapter, DeviceBusyError, RawBlock
from daq.watch import Link
from rigwatch.wire.errors import DeviceError, WireError

_FIRST_WAIT = 0.05
_LONGEST_WAIT = 1.0
R = TypeVar("R")


class Supervisor:
    """An adapter that reconnects by itself.

    Args:
        adapter: opened and closed by this object.
        clock: monotonic time [s].
        sleep: waits for a number of seconds.

    Attributes:
        connected: whether the device is open.
        text: the problem, empty if there is none.
        reconnects: how often it was reopened after a loss.
    """

    def __init__(
        self,
        adapter: Adapter,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.adapter = adapter
        self.connected = False
        self.text = "not opened yet"
        self.reconnects = 0
        self._clock = clock
        self._sleep = sleep
        self._wait = _FIRST_WAIT
        self._next_try = 0.0
        self._ever_open = False

    @property
    def link(self) -> Link:
        """The connection as the watch needs it."""
        trouble = str(getattr(self.adapter, "trouble", ""))
        return Link(self.connected, self.text, self.reconnects, trouble)

    def start(self) -> None:
        """Open the device for the first time; `read` waits for an absent one.

        Raises:
            DeviceBusyError: another process has it: two readers would split its bytes.
        """
        try:
            self._open()
        except DeviceBusyError:
            raise
        except (DeviceError, WireError) as error:
            self._lose(error)

    def read(self, timeout: float) -> Sequence[RawBlock]:
        """What the adapter reads; empty while the device is gone. Waits up to `timeout` [s]."""
        try:
            if not self.connected and not self._reopen(timeout):
                return ()
            blocks = self.adapter.read(timeout)
        except (DeviceError, WireError) as error:
            self._lose(error)
            return ()
        if blocks:
            self._wait, self.text = _FIRST_WAIT, ""
        return blocks

    def attempt(self, read: Callable[[], R]) -> R | None:
        """What `read` reads of the open device, which is lost if that fails."""
        try:
            return read()
        except (DeviceError, WireError) as error:
            self._lose(error)
            return None

    def close(self) -> None:
        """Close the device."""
        self.adapter.close()
        self.connected = False

    def _reopen(self, timeout: float) -> bool:
        pause = self._next_try - self._clock()
        if pause > 0:
            self._sleep(min(pause, timeout))
            return False
        self._open()
        return True

    def _open(self) -> None:
        self.adapter.open()
        self.connected = True
        self.text = "" if not self._ever_open else self.text
        self.reconnects += self._ever_open
        self._ever_open = True

    def _lose(self, error: Exception) -> None:
        self.connected = False
        self.adapter.close()
        self.text = str(error)
        self._next_try = self._clock() + self._wait
        self._wait = min(2.0 * self._wait, _LONGEST_WAIT)

"""Drives the clock of processes that preload `fast_clock.c`: faster, with steps and standstills.

The clock stands still while a process is late with what it has to do, or this one with advancing
the clock: what the machine does not compute in time is then no time for the rig, as in a virtual
machine whose host is busy.
"""

import mmap
import os
import shutil
import struct
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

_SLOTS_AT, _SLOTS, _SLOT = 48, 64, struct.Struct("<qq")
LATE_S = 0.1
"""Lateness of a process at which the clock waits for it [s]."""
LONGEST_STAND_S = 3.0
"""Longest time that the clock waits for a process [s of the machine]."""
TICK = 0.004
"""Interval between advances of the clock [s of the machine]."""
TICKS_AHEAD = 2.5
"""How far the clock goes by itself after an advance [ticks]."""


class FastClock:
    """A clock `rate` times as fast as the machine's, shared with processes of `environment`.

    Args:
        folder: for the compiled library and the shared page.
        start_ns: Unix time at which it starts [ns].
        rate: of this clock to the machine's.

    Attributes:
        stood_s: how long the clock has stood still [s of the machine].
    """

    def __init__(self, folder: Path, start_ns: int, rate: float) -> None:
        self._library = _compiled(folder)
        self._file = folder / "clock.page"
        self._file.write_bytes(bytes(mmap.PAGESIZE))
        with self._file.open("r+b") as file:
            self._page = mmap.mmap(file.fileno(), mmap.PAGESIZE)
        self.rate = rate
        self._version = 0
        self._base, self._then = 10**15, time.monotonic_ns()
        self._offset = start_ns - self._base
        self._ahead = self._step = 0
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self.stood_s, self._late_since = 0.0, dict[int, float]()
        self._niceness = os.getpriority(os.PRIO_PROCESS, 0)
        self._write()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def environment(self) -> dict[str, str]:
        """For processes that shall live by this clock."""
        return {"LD_PRELOAD": str(self._library), "RIGWATCH_FAST_CLOCK": str(self._file)}

    def wall_ns(self) -> int:
        """Unix time of this clock [ns]."""
        with self._lock:
            return self._now(time.monotonic_ns()) + self._offset

    def now_s(self) -> float:
        """Time of this clock, which no step of Unix time changes [s]."""
        with self._lock:
            return self._now(time.monotonic_ns()) * 1e-9

    def set_rate(self, rate: float) -> None:
        """Go at another rate from now on."""
        with self._lock:
            self._advance(going=True)
            self.rate = rate
            self._write()

    def step_wall(self, seconds: float) -> None:
        """Step Unix time only, as a leap second, a time server or a machine that slept does."""
        with self._lock:
            self._step += int(seconds * 1e9)
            self._advance(going=True)

    def wait(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Wait by this clock, or until something holds; whether it holds."""
        with self._lock:
            end = self._now(time.monotonic_ns()) + int(seconds * 1e9)
        while not (held := until()):
            with self._lock:
                left = end - self._now(time.monotonic_ns())
            if left <= 0:
                break
            time.sleep(min(0.01, max(0.0005, left * 1e-9 / self.rate)))
        return held

    def close(self) -> None:
        """Stop advancing."""
        self._stop.set()
        self._thread.join()

    def _now(self, machine: int) -> int:
        return self._base + min(int(self.rate * (machine - self._then)), self._ahead)

    def _run(self) -> None:
        while not self._stop.wait(TICK):
            with self._lock:
                self._advance(self._may_go())

    def _may_go(self) -> bool:
        """Whether all processes keep up, apart from those waited for long enough."""
        machine = time.monotonic()
        late = self._late()
        self._late_since = {pid: self._late_since.get(pid, machine) for pid in late}
        if not any(machine - since < LONGEST_STAND_S for since in self._late_since.values()):
            return True
        self.stood_s += TICK
        return False

    def _late(self) -> list[int]:
        limit, late = self._now(time.monotonic_ns()) - int(LATE_S * 1e9), []
        for at in range(_SLOTS_AT, _SLOTS_AT + _SLOTS * _SLOT.size, _SLOT.size):
            pid, due = _SLOT.unpack_from(self._page, at)
            if pid and due < limit:
                try:
                    # Nobody waits for work that lets others go first, as a search for a cause.
                    if os.getpriority(os.PRIO_PROCESS, pid) <= self._niceness:
                        late.append(pid)
                except ProcessLookupError:
                    _SLOT.pack_into(self._page, at, 0, 0)
        return late

    def _advance(self, going: bool) -> None:
        machine = time.monotonic_ns()
        self._base = self._now(machine)
        self._offset += self._step
        self._then, self._step = machine, 0
        self._write(going)

    def _write(self, going: bool = True) -> None:
        # The page says odd while it changes, so that no reader mixes old and new.
        self._ahead = int(TICKS_AHEAD * TICK * self.rate * 1e9) if going else 0
        struct.pack_into("<Q", self._page, 0, self._version + 1)
        self._version += 2
        fields = (self._base, self._then, self._ahead, self._offset, self.rate)
        struct.pack_into("<qqqqd", self._page, 8, *fields)
        struct.pack_into("<Q", self._page, 0, self._version)


def _compiled(folder: Path) -> Path:
    """The library, built by the machine's C compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        raise FileNotFoundError("no C compiler (cc) on this machine")
    library = folder / "fast_clock.so"
    source = Path(__file__).with_name("fast_clock.c")
    command = [compiler, "-O2", "-shared", "-fPIC", "-o", str(library), str(source), "-ldl"]
    subprocess.run(command, check=True)
    return library

"""One supervised process: start, notifications, output and end."""

import contextlib
import ctypes
import os
import signal
import socket
import subprocess
from functools import partial
from pathlib import Path

from rigwatch.supervisor.plan import ProcessPlan
from rigwatch.supervisor.vitals import Vitals

_LIBC = ctypes.CDLL(None)
_PR_SET_PDEATHSIG = 1
_READ_SIZE = 65536
LONGEST_LINE = 16384
"""Part of a line that is kept [bytes]."""
KILLED_WITHIN = 1.0
"""Longest wait for the end of a killed process [s]."""


class Child:
    """One process, which can be restarted any number of times.

    Args:
        plan: what to run.
        folder: a private folder for its notification socket.
    """

    def __init__(self, plan: ProcessPlan, folder: Path) -> None:
        self.plan = plan
        self.vitals = Vitals(0.0)
        self.last_line = ""
        self._unfinished = b""
        self._skips = False
        self._output = -1
        self._process: subprocess.Popen[bytes] | None = None
        # Not by name: an address has room for a hundred bytes, and a rig's id may be long.
        self._address = str(folder / f"{id(self):x}.notify")
        self.words = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self.words.bind(self._address)
        self.words.setblocking(False)

    @property
    def pid(self) -> int:
        """Process id of the current run, 0 before the first."""
        return self._process.pid if self._process else 0

    def start(self, now: float) -> None:
        """Start it; it dies with this process, but gets no Ctrl-C from the terminal.

        Raises:
            OSError: its program is not there, or there is no room for another process.
        """
        self.close_run()
        environment = {k: v for k, v in os.environ.items() if not k.startswith("WATCHDOG_")}
        environment |= {"NOTIFY_SOCKET": self._address, "PYTHONUNBUFFERED": "1"}
        self.vitals = Vitals(now, reads_device=self.plan.source == "plant")
        self.last_line = ""
        self._output, writing = os.pipe()
        os.set_blocking(self._output, False)
        try:
            self._process = subprocess.Popen(
                self.plan.arguments,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=writing,
                stderr=writing,
                process_group=0,
                # It takes no lock that another thread may hold.
                preexec_fn=partial(die_with, os.getpid()),  # noqa: PLW1509
            )
        except OSError:
            os.close(self._output)
            raise
        finally:
            os.close(writing)

    def listen(self, now: float) -> None:
        """Read its notifications since the last call."""
        with contextlib.suppress(BlockingIOError):
            while True:
                self.vitals.take(self.words.recv(4096).decode(errors="replace"), now)

    def lines(self) -> list[str]:
        """The whole lines it has printed since the last call, without the rest of endless ones."""
        with contextlib.suppress(BlockingIOError):
            self._unfinished += os.read(self._output, _READ_SIZE)
        *whole, self._unfinished = self._unfinished.split(b"\n")
        if whole and self._skips:
            whole, self._skips = whole[1:], False
        if len(self._unfinished) > LONGEST_LINE:
            if not self._skips:
                whole.append(self._unfinished[:LONGEST_LINE] + "…".encode())
            self._unfinished, self._skips = b"", True
        found = [line.decode(errors="replace").rstrip() for line in whole if line.strip()]
        if found:
            self.last_line = found[-1]
        return found

    def exit_code(self) -> int | None:
        """Its exit code, minus the signal that ended it; None while it runs."""
        return self._process.poll() if self._process else 0

    def terminate(self) -> None:
        """Ask it to stop."""
        if self._process is not None:
            self._process.terminate()

    def renew(self) -> None:
        """Ask it to reload its configuration."""
        if self._process is not None:
            self._process.send_signal(signal.SIGHUP)

    def kill(self) -> bool:
        """Kill it and everything that it has started; whether it has ended.

        A process in uninterruptible sleep, as of a disk or driver that does not answer, may stay.
        """
        if self._process is None:
            return True
        for kill in (partial(os.killpg, self._process.pid), self._process.send_signal):
            with contextlib.suppress(ProcessLookupError, PermissionError):
                kill(signal.SIGKILL)
        try:
            self._process.wait(KILLED_WITHIN)
        except subprocess.TimeoutExpired:
            return False
        return True

    def close_run(self) -> bool:
        """Clean up after a run: its children, its pipe, its unread notifications.

        False if it could not be killed: its process is kept for the next attempt.
        """
        if self._process is None:
            return True
        if not self.kill():
            return False
        os.close(self._output)
        self._process, self._unfinished, self._skips = None, b"", False
        with contextlib.suppress(BlockingIOError):
            while True:
                self.words.recv(_READ_SIZE)
        return True

    def close(self) -> None:
        """Kill it and free pipe and socket; a process that cannot be killed is left behind."""
        if not self.close_run():
            os.close(self._output)
            self._process = None
        self.words.close()
        Path(self._address).unlink(missing_ok=True)


def die_with(supervisor: int) -> None:
    """Runs in the new process: a killed supervisor leaves no orphans that hold its ports."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != supervisor:  # it was killed before that: no signal will come
        os._exit(1)

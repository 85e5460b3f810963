"""One child process that can be ended from another thread, also before it has started."""

import os
import signal
import sys
import threading
from collections.abc import Sequence


class Child:
    """At most one run of this Python."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._number: int | None = None
        self._ended = False

    def run(self, words: Sequence[str], given: int | None = None, told: int | None = None) -> int:
        """Start Python with these arguments and wait until it has ended; nothing after `end`.

        Args:
            words: the arguments.
            given: descriptor of what is its standard input; this process's if None.
            told: the same of its standard output.

        Returns:
            its exit code; that of a process that a signal has ended is the negative signal.

        Raises:
            OSError: it cannot be started.
        """
        with self._lock:
            if self._ended:
                return 0
            self._number = number = _started(words, given, told)
        # The number stays the child's until it is waited for, so that `end` kills nobody else.
        os.waitid(os.P_PID, number, os.WEXITED | os.WNOWAIT)
        with self._lock:
            self._number = None
            return os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])

    def end(self) -> None:
        """Kill the child, or keep it from starting."""
        with self._lock:
            self._ended = True
            if self._number is not None:
                os.kill(self._number, signal.SIGKILL)


def _started(words: Sequence[str], given: int | None, told: int | None) -> int:
    # A child would inherit the monitor's real-time class.
    ordinary = os.SCHED_OTHER, os.sched_param(0)
    ends = [
        (os.POSIX_SPAWN_DUP2, own, at) for at, own in enumerate((given, told)) if own is not None
    ]
    return os.posix_spawn(
        sys.executable,
        [sys.executable, *words],
        os.environ,
        file_actions=ends,
        scheduler=ordinary,
    )

"""Settings for a process whose samples must not wait for Python's housekeeping."""

import contextlib
import gc
import os
import sys
from pathlib import Path

SWITCH_INTERVAL = 0.0005
"""A thread that waits for the interpreter lock gets it after this at the latest [s]."""

_AUTOGROUP = Path("/proc/self/autogroup")
NICENESS = -10
"""Above what runs beside, below the kernel's own work."""


def raise_priority() -> None:
    """Be served before other work, where the system allows it (root, CAP_SYS_NICE, systemd's Nice).

    To be called before threads are started: on Linux each has its own niceness, taken over from the
    one that starts it. Where the kernel groups processes by session, niceness counts within the
    session only, and the session has one of its own; it is raised by the session's leader alone, so
    that nobody's terminal is raised along.
    """
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, min(NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))
        if os.getsid(0) == os.getpid():
            _AUTOGROUP.write_text(str(NICENESS))


def prepare_for_real_time() -> None:
    """To be called once, when everything is imported and built, before the loop begins.

    What lives now is never looked at by the garbage collector again, and collections of the old
    generations become rare: they pause the whole process, growing with all that is alive.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 50, 1000)

"""Settings for a process whose samples must not wait for Python's housekeeping."""

import contextlib
import gc
import os
import sys

SWITCH_INTERVAL = 0.0005
"""A thread that waits for the interpreter lock gets it after this at the latest [s]."""

NICENESS = -10
"""Where real time is not allowed; of no use between sessions if the kernel groups by session."""
MONITOR, DAQ, ROUTER = 1, 2, 3
"""A monitor that catches up must hold up neither the samples nor what carries them."""


def raise_priority(urgency: int) -> None:
    """Be served before other work, where the system allows it (root, CAP_SYS_NICE, systemd).

    Takes the real-time class SCHED_RR, else a lower niceness, else nothing. To be called before
    threads are started, which take it over, and after long work such as compiling. The kernel
    keeps a share of each core for the rest even from a process that runs wild.

    Args:
        urgency: who goes first among those that call this: `MONITOR`, `DAQ` or `ROUTER`.
    """
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(urgency))
        return
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, min(NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))


def prepare_for_real_time() -> None:
    """To be called once, when everything is imported and built, before the loop begins.

    What lives now is never looked at by the garbage collector again, and collections of the old
    generations become rare: they pause the whole process, growing with all that is alive.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 50, 1000)

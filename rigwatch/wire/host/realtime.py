"""Real-time settings for a process whose samples must not wait for Python's housekeeping."""

import contextlib
import gc
import os
import sys

from rigwatch.wire.host.few_pools import settle_memory

SWITCH_INTERVAL = 0.0005
"""Longest wait of a thread for the interpreter lock [s]."""

NICENESS = -10
"""Used if real time is not allowed; no effect between sessions if the kernel groups by session."""
MONITOR, DAQ, ROUTER = 1, 2, 3
"""A monitor that catches up must not delay the samples or their transport."""


def raise_priority(urgency: int) -> None:
    """Raise the priority of this process, if permitted (root, CAP_SYS_NICE, systemd).

    Sets the real-time class SCHED_RR, else a lower niceness, else nothing. Call it before threads
    are started, which inherit it, and after long work such as compiling. The kernel reserves a
    share of each core for other work even if the process never sleeps.

    Args:
        urgency: rank among the processes that call this: `MONITOR`, `DAQ` or `ROUTER`.
    """
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(urgency))
        return
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, min(NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))


def be_idle() -> None:
    """Let this process, with the threads that it starts, have only time that nobody else wants."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, 19)
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def prepare_for_real_time() -> None:
    """Settle the memory and tune the garbage collector; call it once, before the loop.

    Collections of the old generations become rare: they pause the whole process, for longer the
    more objects there are.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    settle_memory()
    gc.set_threshold(10_000, 50, 1000)

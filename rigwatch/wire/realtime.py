"""Settings for a process whose samples must not wait for Python's housekeeping."""

import gc
import sys

SWITCH_INTERVAL = 0.0005
"""A thread that waits for the interpreter lock gets it after this at the latest [s]."""


def prepare_for_real_time() -> None:
    """To be called once, when everything is imported and built, before the loop begins.

    What lives now is never looked at by the garbage collector again, and collections of the old
    generations become rare: they pause the whole process, growing with all that is alive.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 50, 1000)

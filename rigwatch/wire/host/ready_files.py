"""Waiting for open files: by `poll`, as `select` knows none above descriptor 1023.

A process of several hundred rigs has that many files open.
"""

import os
import select
import time


def ready_to_read(descriptors: tuple[int, ...], timeout: float) -> list[int]:
    """Those that can be read without waiting, or are at their end; none after `timeout` [s]."""
    poll = select.poll()
    for descriptor in descriptors:
        poll.register(descriptor, select.POLLIN)
    return [descriptor for descriptor, _ in poll.poll(max(0.0, timeout) * 1e3)]


def write_within(descriptor: int, data: bytes, timeout: float) -> int:
    """Write to a file that does not wait.

    Returns:
        How many bytes it has taken within `timeout` [s].

    Raises:
        OSError: it is closed, or its other end is gone.
    """
    poll = select.poll()
    poll.register(descriptor, select.POLLOUT)
    deadline, done = time.monotonic() + timeout, 0
    while done < len(data) and poll.poll(max(0.0, deadline - time.monotonic()) * 1e3):
        done += os.write(descriptor, data[done:])
    return done

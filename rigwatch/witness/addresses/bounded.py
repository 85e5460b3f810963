"""Calls that may hang, with a time limit: a server may send its answer byte by byte for ever."""

import threading
from collections.abc import Callable

from rigwatch.witness.addresses.connections import Connections

MOST_HUNG = 4
"""Calls that may hang at the same time; further ones fail at once."""


class Bounded:
    """Calls one kind of work, each time in a thread of its own.

    After the time its connections are cut, which ends it. A thread that waits for something else
    cannot be ended from outside: it is left behind, and does not keep the process alive.

    Args:
        name: of the threads.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._hung: list[threading.Thread] = []

    def call(self, work: Callable[[], None], longest: float) -> None:
        """Call `work` and wait for it.

        Args:
            work: called in the other thread.
            longest: time for it [s].

        Raises:
            TimeoutError: it has not returned in time, or too many calls before it have not yet.
        """
        self._hung = [thread for thread in self._hung if thread.is_alive()]
        if len(self._hung) >= MOST_HUNG:
            raise TimeoutError(f"{MOST_HUNG} earlier calls have not returned")
        connections = Connections()

        def watched() -> None:
            with connections.watched():
                work()

        thread = threading.Thread(target=watched, name=self._name, daemon=True)
        thread.start()
        thread.join(longest)
        if thread.is_alive():
            connections.cut()
            self._hung.append(thread)
            raise TimeoutError(f"not finished within {longest:g} s")

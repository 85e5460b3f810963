"""Calls that may hang, with a time limit: a server may send its answer byte by byte for ever."""

import threading
from collections.abc import Callable

MOST_HUNG = 4
"""Calls that may hang at the same time; further ones fail at once."""


class Bounded:
    """Calls one kind of work, each time in a thread of its own.

    A thread that hangs cannot be ended from outside. It is left behind until its work ends, and
    does not keep the process alive.

    Args:
        name: of the threads.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._hung: list[threading.Thread] = []

    def call(
        self, work: Callable[[], None], longest: float, cut: Callable[[], None] | None = None
    ) -> None:
        """Call `work` and wait for it.

        Args:
            work: called in the other thread.
            longest: time for it [s].
            cut: called after that time, to make `work` return.

        Raises:
            TimeoutError: it has not returned in time, or too many calls before it have not yet.
        """
        self._hung = [thread for thread in self._hung if thread.is_alive()]
        if len(self._hung) >= MOST_HUNG:
            raise TimeoutError(f"{MOST_HUNG} earlier calls have not returned")
        thread = threading.Thread(target=work, name=self._name, daemon=True)
        thread.start()
        thread.join(longest)
        if thread.is_alive():
            if cut is not None:
                cut()
            self._hung.append(thread)
            raise TimeoutError(f"not finished within {longest:g} s")

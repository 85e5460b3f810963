"""One thread reads the open devices of several rigs, one after the other.

    rig's thread   joins the bus, opens the device ──serve──▶ waits      ◀── lost, failed, stopped
    turns' thread                                     └▶ step, step, step … each turn

With a thread for each of sixteen rigs, more than half of the processor's time went to handing the
interpreter from one to another. A device that may keep its reader waiting stays in its own thread.
"""

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field

Step = Callable[[], bool]
"""One reading of a device; whether it shall go on."""


@dataclass(eq=False)
class _Served:
    step: Step
    ended: threading.Event = field(default_factory=threading.Event)
    error: BaseException | None = None


class Turns:
    """The readings of all rigs of a process.

    Args:
        turn: time from one turn to the next [s]; turns begin at multiples of it.
        together: entered for each turn, so that what it sends leaves together.
    """

    def __init__(self, turn: float, together: Callable[[], AbstractContextManager[object]]) -> None:
        self.turn = turn
        self._together = together
        self._served: list[_Served] = []
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def serve(self, step: Step) -> None:
        """Take `step` in every turn until it returns False; what it raises is raised here."""
        one = _Served(step)
        with self._lock:
            self._served.append(one)
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="turns", daemon=True)
                self._thread.start()
        one.ended.wait()
        if one.error is not None:
            raise one.error

    def _run(self) -> None:
        while self._goes_on():
            time.sleep(self.turn - time.monotonic() % self.turn)
            with self._together():
                for one in tuple(self._served):
                    self._take(one)

    def _goes_on(self) -> bool:
        with self._lock:
            if not self._served:
                self._thread = None
            return bool(self._served)

    def _take(self, one: _Served) -> None:
        try:
            if one.step():
                return
        except Exception as error:  # raised in the rig's own thread
            one.error = error
        with self._lock:
            self._served.remove(one)
        one.ended.set()

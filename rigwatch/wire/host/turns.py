"""One thread does what is due of several rigs, one after the other: devices read, sessions written.

    rig's thread   joins the bus, opens the device ──serve──▶ waits      ◀── lost, failed, stopped
    turns' thread                                     └▶ step, step │ step, step │ … each turn

With a thread for each of sixteen rigs, more than half of the processor's time went to handing the
interpreter from one to another. A device that may keep its reader waiting stays in its own thread.

A turn of many rigs has several parts, at equal distances: read all at once, the last of forty rigs
would wait in daq and in the monitor until those before it have been worked on. A part has several
rigs, since a message among others costs a tenth of one on its own.
"""

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any

Step = Callable[[], bool]
"""What is due of a rig in a turn; returns whether to continue."""
PART = 16
"""Rigs in a part of a turn of devices, at least, if there are so many."""
SHORTEST_PART = 0.005
"""Shortest part of a turn: the turn of the monitor, which takes what came in it together [s]."""


def _each_alone(_subjects: Sequence[Any]) -> None:
    """Leave all to the rigs' steps."""


@dataclass(eq=False)
class _Served:
    step: Step
    subject: Any
    ended: threading.Event = field(default_factory=threading.Event)
    error: BaseException | None = None


class Turns:
    """The turns of the rigs of a process.

    Args:
        turn: time from one turn to the next [s].
        together: entered for each part of a turn, so that what it sends leaves together.
        clock: monotonic time [s].
        sleep: waits for a number of seconds.
        before: called with the subjects of all rigs of a part, before their steps.
        part: rigs in a part of a turn, at least, if there are so many.
    """

    def __init__(
        self,
        turn: float,
        together: Callable[[], AbstractContextManager[object]],
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        *,
        before: Callable[[Sequence[Any]], None] = _each_alone,
        part: int = PART,
    ) -> None:
        self.turn = turn
        self._part = part
        self._before = before
        self._together, self._clock, self._sleep = together, clock, sleep
        self._served: list[_Served] = []
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def serve(self, step: Step, subject: Any = None) -> None:
        """Take `step` in every turn until it returns False; what it raises is raised here.

        Args:
            step: of the rig.
            subject: what is done with several rigs before their steps needs of it.
        """
        one = _Served(step, subject)
        with self._lock:
            self._served.append(one)
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="turns", daemon=True)
                self._thread.start()
        one.ended.wait()
        if one.error is not None:
            raise one.error

    def _run(self) -> None:
        due = self._clock()
        while self._goes_on():
            # A turn that took too long is followed by the next one at once.
            due = max(due + self.turn, self._clock())
            self._take_all(due)

    def _take_all(self, due: float) -> None:
        """The turn that begins at `due`."""
        rigs = tuple(self._served)
        parts = self._parts_of(len(rigs))
        for number in range(parts):
            self._sleep(max(0.0, due + number * self.turn / parts - self._clock()))
            with self._together():
                self._take_part(rigs[number::parts])

    def _take_part(self, rigs: Sequence[_Served]) -> None:
        try:
            self._before([one.subject for one in rigs])
        except Exception as error:  # raised in the threads of all these rigs
            for one in rigs:
                self._end(one, error)
            return
        for one in rigs:
            self._take(one)

    def _parts_of(self, rigs: int) -> int:
        return max(1, min(rigs // self._part, int(self.turn / SHORTEST_PART)))

    def _goes_on(self) -> bool:
        with self._lock:
            if not self._served:
                self._thread = None
            return bool(self._served)

    def _take(self, one: _Served) -> None:
        try:
            if not one.step():
                self._end(one)
        except Exception as error:  # raised in the rig's own thread
            self._end(one, error)

    def _end(self, one: _Served, error: Exception | None = None) -> None:
        one.error = error
        with self._lock:
            self._served.remove(one)
        one.ended.set()

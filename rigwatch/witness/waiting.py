"""The notices that wait for one recipient: one of each alarm, the worst first, none dropped.

    put ──▶ waiting ──take──▶ one notice, or in a flood one message of many ──▶ sent
               ▲                                                      │ failed
               └──────────────── again after a pause ─────────────────┘

A notice waits until it has been sent or somebody has seen its alarm, however long the recipient
cannot be reached. A message of many that fails is followed by one of its notices alone: a text that
the service refuses must not hold back the others.
"""

import threading
import time

from rigwatch.witness.notices import Notice
from rigwatch.witness.people import SEVERITIES

PAUSES_S = (2.0, 10.0, 60.0, 300.0)
"""Pauses after the first and further failures in a row [s]; the last one repeats."""
FEW = 3
"""Up to so many waiting notices are sent one by one, more of them as one message."""
MOST_TOGETHER = 50
"""Notices in one message."""


class Waiting:
    """The notices of one recipient; any thread may call it, one of them `take`.

    Args:
        together: whether many may be sent as one message.
    """

    def __init__(self, *, together: bool) -> None:
        self._together = together
        self._changed = threading.Condition()
        self._notices: dict[str, Notice] = {}
        self._taken: tuple[Notice, ...] = ()
        self._seen: set[str] = set()
        self._attempts: dict[str, int] = {}
        self._failures = 0
        self._failed_at = float("-inf")
        self._has_ended = False

    def __len__(self) -> int:
        with self._changed:
            return len(self._notices.keys() | {one.alarm.name for one in self._taken})

    def put(self, notice: Notice) -> None:
        """Let a notice wait, in place of an earlier one of the same alarm."""
        with self._changed:
            self._notices[notice.alarm.name] = notice
            self._seen.discard(notice.alarm.name)
            self._changed.notify()

    def withdraw(self, name: str) -> bool:
        """Somebody has seen the alarm `name`; returns whether a notice of it has waited."""
        with self._changed:
            self._seen.add(name)
            self._attempts.pop(name, None)
            return self._notices.pop(name, None) is not None

    def end(self) -> None:
        """Send what waits, each once, then end."""
        with self._changed:
            self._has_ended = True
            self._changed.notify()

    def take(self) -> tuple[Notice, ...]:
        """Wait for what has to be sent now; empty if nothing more will."""
        with self._changed:
            while True:
                left = self._left(time.monotonic())
                if left is not None and left <= 0:
                    break
                if self._has_ended and not self._notices:
                    return ()
                self._changed.wait(left)
            self._taken = self._chosen()
            self._seen.clear()
            for one in self._taken:
                del self._notices[one.alarm.name]
            return self._taken

    def sent(self) -> None:
        """What was taken has been sent."""
        with self._changed:
            self._failures = 0
            for one in self._taken:
                self._attempts.pop(one.alarm.name, None)
            self._taken = ()

    def failed(self) -> int:
        """What was taken has not been sent and waits again.

        Returns:
            how many notices are given up: somebody has seen the alarm meanwhile, or the recipient
            has been left out.
        """
        with self._changed:
            self._failures += 1
            self._failed_at = time.monotonic()
            back, self._taken = self._taken, ()
            again = [one for one in back if one.alarm.name not in self._seen]
            again = [] if self._has_ended else again
            for one in again:
                self._notices.setdefault(one.alarm.name, one)
                self._attempts[one.alarm.name] = self._attempts.get(one.alarm.name, 0) + 1
            return len(back) - len(again)

    def _left(self, now: float) -> float | None:
        """Time until something has to be sent [s]; None if nothing waits."""
        if not self._notices:
            return None
        if not self._failures or self._has_ended:
            return 0.0
        # A new notice does not wait for the end of a long pause.
        is_new = not self._notices.keys() <= self._attempts.keys()
        pause = PAUSES_S[0 if is_new else min(self._failures, len(PAUSES_S)) - 1]
        return self._failed_at + pause - now

    def _chosen(self) -> tuple[Notice, ...]:
        notices = sorted(self._notices.values(), key=self._rank)
        many = self._together and len(notices) > FEW and self._failures % 2 == 0
        return tuple(notices[: MOST_TOGETHER if many else 1])

    def _rank(self, notice: Notice) -> tuple[int, int, int]:
        """Those that failed least, of these the worst, of these the first."""
        alarm = notice.alarm
        return self._attempts.get(alarm.name, 0), -SEVERITIES.index(alarm.severity), alarm.t_ns

"""Delivers notices, each recipient in a thread of its own, so that none delays another.

Notices ──▶ waiting for the recipient ──▶ thread: command or Apprise, repeated on failure
"""

import threading
from collections.abc import Sequence
from pathlib import Path

from rigwatch.witness.addresses import Sender, sender_of
from rigwatch.witness.notices import Notice
from rigwatch.witness.people import PeopleFile, RecipientSection
from rigwatch.witness.waiting import Waiting


class Tally:
    """Figures of all recipients, counted by their threads."""

    def __init__(self) -> None:
        self.counted = dict.fromkeys(("sent", "failed", "given_up", "withdrawn"), 0)
        self._lock = threading.Lock()

    def add(self, name: str, count: int = 1) -> None:
        """Count so many notices."""
        with self._lock:
            self.counted[name] += count


class Delivery:
    """The threads of all recipients.

    Args:
        rig: id of the rig, named in messages.
        file: the file of people, for errors.
    """

    def __init__(self, rig: str, file: Path) -> None:
        self._rig, self._file = rig, file
        self._tally = Tally()
        self._lines: dict[RecipientSection, _Line] = {}

    def use(self, people: PeopleFile) -> None:
        """Deliver to these recipients from now on; those left out get what is queued for them.

        Raises:
            ConfigError: an address cannot be used; nothing is changed.
            MissingExtraError: addresses are given, and apprise is not installed.
        """
        new = [one for one in people.recipients if one not in self._lines]
        senders = {one: sender_of(one, self._rig, self._file) for one in new}
        for gone in self._lines.keys() - set(people.recipients):
            self._lines.pop(gone).waiting.end()
        for one, sender in senders.items():
            self._lines[one] = _Line(one.name, sender, self._tally)

    def send(self, notices: Sequence[Notice]) -> None:
        """Queue notices; never waits."""
        for notice in notices:
            for line in self._lines.values():
                if line.name == notice.recipient:
                    line.waiting.put(notice)

    def withdraw(self, name: str) -> None:
        """Somebody has seen the alarm `name`: what waits of it is not sent any more."""
        for line in self._lines.values():
            self._tally.add("withdrawn", line.waiting.withdraw(name))

    @property
    def counters(self) -> dict[str, float]:
        """Figures for the health message."""
        waiting = sum(len(line.waiting) for line in self._lines.values())
        figures = self._tally.counted | {"waiting": waiting}
        return {f"notifications_{name}": float(count) for name, count in figures.items()}

    @property
    def trouble(self) -> str:
        """Recipients whose last notice was not delivered, in words; "" for none."""
        names = [line.name for line in self._lines.values() if line.is_failing]
        return f"notifications to {', '.join(names)} fail" if names else ""


class _Line:
    """One recipient: what waits for it, and its thread."""

    def __init__(self, name: str, sender: Sender, tally: Tally) -> None:
        self.name = name
        self.is_failing = False
        self.waiting = Waiting(together=sender.together)
        self._sender, self._tally = sender, tally
        threading.Thread(target=self._run, name=f"notify {name}", daemon=True).start()

    def _run(self) -> None:
        while notices := self.waiting.take():
            if self._attempt(notices):
                self.is_failing = False
                self.waiting.sent()
                self._tally.add("sent", len(notices))
            else:
                self.is_failing = True
                self._tally.add("failed", len(notices))
                self._tally.add("given_up", self.waiting.failed())

    def _attempt(self, notices: Sequence[Notice]) -> bool:
        try:
            return self._sender.send(notices)
        except Exception:
            # Apprise's plugins raise what their libraries raise; the thread has to survive.
            return False

"""Delivers notices, each recipient in a thread of its own, so that none delays another.

Notices ──▶ queue of the recipient ──▶ thread: command or Apprise, repeated on failure
"""

import contextlib
import json
import logging
import os
import queue
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from rigwatch.wire.errors import ConfigError, MissingExtraError
from rigwatch.wire.messages import json_fields
from rigwatch.witness.bounded import Bounded
from rigwatch.witness.notices import Notice
from rigwatch.witness.people import PeopleFile, RecipientSection

WAITING = 100
"""Notices queued per recipient; further ones are dropped and counted."""
RETRIES_S = (2.0, 10.0, 60.0)
"""Pauses before further attempts of a notice that failed [s]."""
COMMAND_S = 60.0
"""Longest run of a command [s]."""
ADDRESS_S = 30.0
"""Longest attempt to reach an address; its server may send its answer byte by byte for ever [s]."""
Send = Callable[[Notice], bool]


class Tally:
    """Figures of all recipients, counted by their threads."""

    def __init__(self) -> None:
        self.counted = dict.fromkeys(("sent", "failed", "given_up", "dropped"), 0)
        self._lock = threading.Lock()

    def add(self, name: str) -> None:
        """Count one."""
        with self._lock:
            self.counted[name] += 1


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
        senders = {one: _sender(one, self._rig, self._file) for one in new}
        for gone in self._lines.keys() - set(people.recipients):
            self._lines.pop(gone).end()
        for one, send in senders.items():
            self._lines[one] = _Line(one.name, send, self._tally)

    def send(self, notices: Sequence[Notice]) -> None:
        """Queue notices; never waits."""
        for notice in notices:
            for line in self._lines.values():
                if line.name == notice.recipient:
                    line.put(notice)

    @property
    def counters(self) -> dict[str, float]:
        """Figures for the health message."""
        waiting = sum(line.waiting for line in self._lines.values())
        figures = self._tally.counted | {"waiting": waiting}
        return {f"notifications_{name}": float(count) for name, count in figures.items()}

    @property
    def trouble(self) -> str:
        """Recipients whose last notice was not delivered, in words; "" for none."""
        names = [line.name for line in self._lines.values() if line.is_failing]
        return f"notifications to {', '.join(names)} fail" if names else ""


class _Line:
    """One recipient: its queue and thread."""

    def __init__(self, name: str, send: Send, tally: Tally) -> None:
        self.name = name
        self.is_failing = False
        self._send, self._tally = send, tally
        self._queue: queue.Queue[Notice | None] = queue.Queue(WAITING + 1)
        threading.Thread(target=self._run, name=f"notify {name}", daemon=True).start()

    @property
    def waiting(self) -> int:
        return self._queue.qsize()

    def put(self, notice: Notice) -> None:
        if self._queue.qsize() >= WAITING:
            self._tally.add("dropped")
        else:
            self._queue.put_nowait(notice)

    def end(self) -> None:
        """End the thread after what is queued."""
        self._queue.put_nowait(None)

    def _run(self) -> None:
        while (notice := self._queue.get()) is not None:
            self._deliver(notice)

    def _deliver(self, notice: Notice) -> None:
        for pause in (0.0, *RETRIES_S):
            time.sleep(pause)
            if self._attempt(notice):
                self.is_failing = False
                self._tally.add("sent")
                return
            self.is_failing = True
            self._tally.add("failed")
        self._tally.add("given_up")

    def _attempt(self, notice: Notice) -> bool:
        try:
            return self._send(notice)
        except Exception:
            # Apprise's plugins raise what their libraries raise; the thread has to survive.
            return False


def _sender(recipient: RecipientSection, rig: str, file: Path) -> Send:
    if recipient.command:
        return lambda notice: _run_command(recipient.command, notice, rig)
    return _apprise_sender(recipient, rig, file)


def _run_command(command: Sequence[str], notice: Notice, rig: str) -> bool:
    alarm = notice.alarm
    with subprocess.Popen(
        [*command, alarm.name, alarm.severity, alarm.cause],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        env={**os.environ, "RIGWATCH_RIG": rig},
        process_group=0,
    ) as process:
        try:
            process.communicate(json.dumps(json_fields(alarm)).encode(), COMMAND_S)
        finally:
            # What hangs is often not the command but what it has started.
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
    return process.returncode == 0


def _apprise_sender(recipient: RecipientSection, rig: str, file: Path) -> Send:
    try:
        import apprise
    except ImportError:
        raise MissingExtraError("apprise", "notify", "notification by address") from None
    logging.getLogger("apprise").setLevel(logging.CRITICAL)
    # One service alone is called on this thread. Apprise's own are waited for when a process ends.
    service = apprise.Apprise.instantiate(recipient.url)
    if service is None:
        scheme = recipient.url.partition(":")[0]
        found = f"an address {scheme}:… that Apprise cannot use"
        raise ConfigError(
            file, f"recipients.{recipient.name}.url", found, "one such as mailtos://…"
        )
    kinds = {"info": apprise.NotifyType.INFO, "warning": apprise.NotifyType.WARNING}

    def send(notice: Notice) -> bool:
        title, body = text_of(notice, rig)
        kind = kinds.get(notice.alarm.severity, apprise.NotifyType.FAILURE)
        return bool(service.notify(body, title=title, notify_type=kind))

    return _bounded(send)


def _bounded(send: Send) -> Send:
    """The same, ended after a while."""
    bounded = Bounded("notify")

    def within(notice: Notice) -> bool:
        reached: list[bool] = []

        def attempt() -> None:
            with contextlib.suppress(Exception):  # as the plugins of Apprise raise
                reached.append(send(notice))

        bounded.call(attempt, ADDRESS_S)
        return bool(reached and reached[0])

    return within


def text_of(notice: Notice, rig: str) -> tuple[str, str]:
    """Title and text of a notice."""
    alarm = notice.alarm
    again = f", notice {notice.times + 1}" if notice.times else ""
    lasting = f", unacknowledged for {notice.minutes:.0f} min" if notice.minutes >= 1 else ""
    cleared = ", cleared" if alarm.state == "cleared_unacknowledged" else ""
    when = datetime.fromtimestamp(alarm.t_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    title = f"[{rig}] {alarm.severity}: {alarm.name}{cleared}{lasting}{again}"
    return title, f"{alarm.cause}\n\n{alarm.guidance}\n\n{when}"

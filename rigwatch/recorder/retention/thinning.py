"""Thins old sessions in the background, by a process of its own that thins one and ends.

    recorder ──start──▶ rigwatch archive thin FOLDER … ──one line of JSON──▶ event

The process takes only processor time that nobody else wants. One rig of a recorder is thinned at a
time, and there are pauses between two sessions of a rig.
"""

import json
import os
import random
import subprocess
import sys
import threading
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from rigwatch.wire.host import end_process
from rigwatch.wire.messages import Event
from rigwatch.wire.rig_config import RecorderSection

SOURCE = "recorder"
EVERY = 3600.0
"""Time from a look that found nothing to thin to the next [s]."""
AGAIN = 60.0, 600.0
"""Least and longest time from one that failed to the next [s]; drawn, as rigs that share a folder
write one index in turns."""
PAUSE, RESTS = 60.0, 3.0
"""Pause after a session that was thinned: at least so long [s], and so many times as it took."""
FIRST = 60.0
"""Time from the start of the recorder to the first look [s]."""
STOP_TIMEOUT = 1.0
_one_at_a_time = threading.Lock()
"""Held while a process thins: hundreds of rigs would start as many at once."""


class Thinning:
    """The thinning of one rig's sessions.

    Args:
        settings: section [recorder].
        rig: the rig whose sessions are thinned.
    """

    def __init__(self, settings: RecorderSection, rig: str) -> None:
        self._words = _words(settings, rig)
        self._process: subprocess.Popen[bytes] | None = None
        self._began = 0.0
        self._due: float | None = None
        self._trouble, self._told = "", ""

    def update(self, now: float, t_ns: int) -> list[Event]:
        """Start a process if it is due, and report what one that has ended did; never waits.

        Args:
            now: monotonic time [s].
            t_ns: Unix time by which ages count [ns].
        """
        if not self._words:
            return []
        self._due = now + FIRST if self._due is None else self._due
        if self._process is None:
            if now < self._due or not _one_at_a_time.acquire(blocking=False):
                return []
            try:
                self._start(now, t_ns)
            except OSError as error:
                _one_at_a_time.release()
                self._due = now + EVERY
                return self._failed(str(error), t_ns)
        assert self._process is not None
        if (code := self._process.poll()) is None:
            return []
        self._process = None
        _one_at_a_time.release()
        return self._ended(code, now, t_ns)

    def close(self) -> None:
        """End a process; what it has begun is finished by the next."""
        if self._process is not None:
            end_process(self._process, STOP_TIMEOUT)
            self._process = None
            _one_at_a_time.release()

    def _start(self, now: float, t_ns: int) -> None:
        self._began = now
        self._said, self._erred = TemporaryFile(), TemporaryFile()  # noqa: SIM115 -- of the process
        self._process = subprocess.Popen(
            (*self._words, "--now", f"{t_ns / 1e9:.3f}"),
            stdin=subprocess.DEVNULL,
            stdout=self._said,
            stderr=self._erred,
            env={**os.environ, **dict.fromkeys(_SINGLE, "1")},
        )

    def _ended(self, code: int, now: float, t_ns: int) -> list[Event]:
        done = _read(self._said)
        words = _text(self._erred).splitlines()
        self._said.close()
        self._erred.close()
        session, failures = done.get("session", ""), done.get("failures", [])
        self._due = now + (max(PAUSE, RESTS * (now - self._began)) if session else EVERY)
        if not session and (code or failures):
            self._due = now + random.uniform(*AGAIN)
            return self._failed((failures or words or [f"exit code {code}"])[-1], t_ns)
        self._trouble = self._told = ""
        if not session:
            return []
        text = f"{session}: {done['size'] / 1e6:.1f} MB removed, its figures per second are kept"
        return [Event(SOURCE, t_ns, "info", "RECORDING_THINNED", text)]

    def _failed(self, why: str, t_ns: int) -> list[Event]:
        """Tell once of a trouble that has come twice: another process may have held the index."""
        before, self._trouble = self._trouble, why
        if why in (self._told, "") or why != before:
            return []
        self._told = why
        text = f"old sessions cannot be thinned: {why}"
        return [Event(SOURCE, t_ns, "warning", "THINNING_FAILED", text)]


_SINGLE = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "ARROW_NUM_THREADS")


def _words(settings: RecorderSection, rig: str) -> tuple[str, ...]:
    """The command; empty if nothing is to be thinned."""
    days, alarm_days = settings.thin_days, settings.thin_alarm_days
    if not days and not alarm_days:
        return ()
    limits = "--rig", rig, "--days", f"{days!r}", "--alarm-days", f"{alarm_days!r}"
    command = (sys.executable, "-m", "rigwatch", "archive", "thin", str(Path(settings.folder)))
    return (*command, *limits, "--idle", "--json")


def _read(file: Any) -> dict[str, Any]:
    try:
        found = json.loads(_text(file))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _text(file: Any) -> str:
    file.seek(0)
    return str(file.read().decode(errors="replace"))

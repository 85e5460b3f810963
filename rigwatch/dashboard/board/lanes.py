"""Coloured lanes over time: the verdict on the rig, and one lane per alarm."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import rerun as rr

from rigwatch.dashboard.board import entities as at
from rigwatch.dashboard.board import palette
from rigwatch.dashboard.board.alarm_book import LANES, AlarmBook
from rigwatch.wire.messages import Alarm


class Lanes:
    """Draws the lanes; a lane begins at the first known time.

    Args:
        stream: target.
        book: states of the alarms so far.
    """

    def __init__(self, stream: rr.RecordingStream, book: AlarmBook) -> None:
        self._stream, self._book = stream, book
        self._verdict = ""
        self._names: set[str] = set()
        self._configure(at.VERDICT, palette.VERDICTS)
        for name in (*LANES, *(alarm.name for alarm in book.faults())):
            self._add(name)

    def begin(self, t_ns: int) -> None:
        """Start the lanes; called once, when the first time is known."""
        for name in self._names:
            self._start(name, t_ns)

    def alarm(self, alarm: Alarm) -> None:
        """One transition, on its own lane."""
        if alarm.severity == "info":
            return  # a remark: it is in the text and the log, and would only fill the screen
        if alarm.name not in self._names:
            self._add(alarm.name)
        self._change(_path(alarm.name), alarm.state, alarm.t_ns)

    def verdict(self, verdict: str, t_ns: int) -> None:
        """Set the verdict; drawn when it changes."""
        if verdict != self._verdict:
            self._verdict = verdict
            self._change(at.VERDICT, verdict, t_ns)

    def _add(self, name: str) -> None:
        self._names.add(name)
        self._configure(_path(name), palette.STATES)

    def _start(self, name: str, t_ns: int) -> None:
        last = self._book.last.get(name)
        self._change(_path(name), last.state if last else "normal", t_ns)

    def _change(self, path: str, state: str, t_ns: int) -> None:
        self._stream.set_time(at.TIMELINE, timestamp=np.datetime64(t_ns, "ns"))
        self._stream.log(path, rr.StateChange(state=state))

    def _configure(self, path: str, looks: Mapping[Any, tuple[str, palette.Colour]]) -> None:
        states = rr.StateConfiguration(
            values=list(looks),
            labels=[label for label, _ in looks.values()],
            colors=np.array([palette.rgba(colour) for _, colour in looks.values()], np.uint32),
        )
        self._stream.log(path, states, static=True)


def _path(name: str) -> str:
    return rr.new_entity_path([at.LANES, name])

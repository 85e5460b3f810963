"""Alarms that a process tells again after a restart, to whom they are no news.

A monitor that starts again tells what stands, as subscribers may have joined while there was none.
Those that have heard the same change from the run before do not hear it twice.
"""

from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import Alarm, decode
from rigwatch.wire.ordering import Numbered

_Change = tuple[str, int, int, int]


class Retold:
    """The last change of each alarm of each process, and the run that told it."""

    def __init__(self) -> None:
        self._last: dict[tuple[str, str], tuple[int, _Change]] = {}

    def is_repeat(self, process: str, message: Numbered) -> bool:
        """Whether another run of the process has told this change last; what is no alarm is new."""
        try:
            alarm = decode(Alarm, message.payload)
        except MessageError:
            return False
        change = alarm.state, alarm.t_ns, alarm.boot, alarm.seq
        run, last = self._last.get((process, alarm.name), (message.boot, None))
        self._last[process, alarm.name] = message.boot, change
        return run != message.boot and last == change

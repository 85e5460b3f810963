"""Who may say how many alarms, so that no process pushes those of another out of bounded memories.

Receivers remember `MOST_ALARMS` alarms. A monitor has a third of that at most, a witness one; what
any other process says comes from a stranger on a bus without keys.
"""

from rigwatch.wire.access import alarm_roles
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import MOST_ALARMS, Alarm, decode

OWN_SHARE, STRANGERS_SHARE = MOST_ALARMS // 3, 32
"""Different alarms of a process of the rig, and of any other."""


class AlarmShares:
    """The names that each process has said."""

    def __init__(self) -> None:
        self._refused: set[str] = set()
        self._said: dict[str, set[str]] = {}

    def admits(self, process: str, payload: bytes) -> bool:
        """Whether an alarm of `process` is within its share; what is no alarm is decided later."""
        try:
            name = decode(Alarm, payload).name
        except MessageError:
            return True
        said = self._said.setdefault(process, set())
        share = OWN_SHARE if process in alarm_roles() else STRANGERS_SHARE
        if name not in said and len(said) >= share:
            return False
        said.add(name)
        return True

    def is_first_refusal(self, process: str) -> bool:
        """Whether this is asked of a process for the first time."""
        asked = process in self._refused
        self._refused.add(process)
        return not asked

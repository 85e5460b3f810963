"""What the witness has said in a file, so that its next run answers for it.

The alarm is kept before it is sent (`kept_alarm.py`). One that a killed witness has kept and not
sent is said by the next one, as the end of that run. Of one that had ended nothing is kept: the end
of the run is not known then, and subscribers report a gap.
"""

import contextlib
from pathlib import Path

from rigwatch.wire.bus import KeptMessages
from rigwatch.wire.errors import MessageError, SessionError
from rigwatch.wire.host import Kept
from rigwatch.wire.messages import Alarm, decode, encode


class SaidAlarms:
    """The alarms that the witnesses of a rig have said.

    Args:
        path: the file; None keeps nothing, nor does a second witness of the rig.
        standing: the alarm that the last one has left, or None.

    Attributes:
        messages: the file, or None.
    """

    def __init__(self, path: Path | None, standing: Alarm | None) -> None:
        self.messages: KeptMessages | None = None
        self._alone: Kept | None = None
        if path is None:
            return
        with contextlib.suppress(SessionError):
            self._alone = Kept(
                path.with_name(f"{path.name}.lock"), f"{path}: alarms of the witness"
            )
            self.messages = KeptMessages(path)
            self.messages.complete(unsaid(standing, self.messages))

    def close(self) -> None:
        """End the run, and let another keep the file."""
        if self.messages:
            self.messages.close()
        if self._alone:
            self._alone.give_up()


def unsaid(standing: Alarm | None, said: KeptMessages) -> list[bytes] | None:
    """What the last witness was about to say; None if that is not known."""
    if standing is not None:
        kept = encode(standing)
        return [] if kept in said.payloads else [kept]
    with contextlib.suppress(MessageError):
        if said.newest is None or decode(Alarm, said.newest).state == "normal":
            return []
    return None

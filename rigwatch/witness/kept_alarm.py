"""The witness's alarm in a file beside the alarm journal, so that it outlives a killed witness.

Without it, pages that are open would show an alarm that nobody can clear any more, and pages opened
later would not show one that nobody has seen.
"""

import contextlib
import logging
from pathlib import Path

from rigwatch.wire.errors import MessageError, reason_of
from rigwatch.wire.host import replace_file
from rigwatch.wire.messages import Alarm, decode, encode
from rigwatch.wire.rig_config import RigConfig

_log = logging.getLogger(__name__)


class KeptAlarm:
    """One standing alarm, or none.

    Args:
        path: the file; None keeps nothing.
    """

    def __init__(self, path: Path | None = None) -> None:
        self._path = path

    def read(self) -> Alarm | None:
        """The alarm that an earlier run left, None if there is none or it is damaged."""
        if self._path is None:
            return None
        with contextlib.suppress(OSError, MessageError):
            return decode(Alarm, self._path.read_bytes())
        return None

    def write(self, alarm: Alarm | None) -> None:
        """Replace the file, or remove it; what fails is logged, as the alarm is sent anyway."""
        if self._path is None:
            return
        try:
            if alarm is None:
                self._path.unlink(missing_ok=True)
            else:
                replace_file(self._path, encode(alarm))
        except OSError as error:
            _log.warning("%s: cannot be written: %s", self._path, reason_of(error))


def beside_journal(config: RigConfig) -> Path | None:
    """The file of a rig; none without an alarm journal."""
    journal = config.monitor.journal if config.monitor else ""
    return Path(f"{journal}.stale") if journal else None

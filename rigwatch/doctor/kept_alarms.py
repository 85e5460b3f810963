"""What monitor and witness keep of the alarms that they have sent, beside the journal.

.said         monitor    its last alarms, numbered: its next run answers for them
.stale        witness    its alarm that stands
.stale.said   witness    its last alarms, numbered
"""

from collections.abc import Iterator
from pathlib import Path

from rigwatch.doctor.kept import Kept
from rigwatch.wire.bus import kept_runs
from rigwatch.wire.errors import MessageError, reason_of
from rigwatch.wire.messages import Alarm, decode

MONITOR, WITNESS = "{}.said", "{}.stale.said"
_STANDING = "{}.stale"


def kept_alarms(journal: str) -> Iterator[Kept]:
    """The files of this kind beside an alarm journal, those that exist."""
    unheard = "set it aside; alarms of earlier runs that nobody has heard count as lost"
    anew = "set it aside; the witness raises its alarm anew if it has a reason"
    for what, name, read, change in (
        ("alarms sent", MONITOR, _said, unheard),
        ("witness's alarm", _STANDING, _standing, anew),
        ("witness's alarms sent", WITNESS, _said, unheard),
    ):
        path = Path(name.format(journal))
        try:
            text = read(path)
        except FileNotFoundError:
            continue
        except OSError as error:
            yield Kept(what, path, reason_of(error), "fail")
        except MessageError:
            yield Kept(what, path, "it is damaged", "warn", change, path.unlink)
        else:
            yield Kept(what, path, text)


def _said(path: Path) -> str:
    runs = kept_runs(path)
    return f"{sum(len(run.messages) for run in runs)} alarms of {len(runs)} runs"


def _standing(path: Path) -> str:
    alarm = decode(Alarm, path.read_bytes())
    return f"{alarm.name} is {alarm.state}"

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
    yield from _said("alarms sent", Path(MONITOR.format(journal)))
    yield from _standing(Path(_STANDING.format(journal)))
    yield from _said("witness's alarms sent", Path(WITNESS.format(journal)))


def _said(what: str, path: Path) -> Iterator[Kept]:
    try:
        runs = kept_runs(path)
    except FileNotFoundError:
        return
    except OSError as error:
        yield Kept(what, path, reason_of(error), "fail")
    except MessageError:
        change = "set it aside; alarms of earlier runs that nobody has heard count as lost"
        yield Kept(what, path, "it is damaged", "warn", change, path.unlink)
    else:
        alarms = sum(len(run.messages) for run in runs)
        yield Kept(what, path, f"{alarms} alarms of {len(runs)} runs")


def _standing(path: Path) -> Iterator[Kept]:
    what = "witness's alarm"
    try:
        alarm = decode(Alarm, path.read_bytes())
    except FileNotFoundError:
        return
    except OSError as error:
        yield Kept(what, path, reason_of(error), "fail")
    except MessageError:
        change = "set it aside; the witness raises its alarm anew if it has a reason"
        yield Kept(what, path, "it is damaged", "warn", change, path.unlink)
    else:
        yield Kept(what, path, f"{alarm.name} is {alarm.state}")

"""What earlier years have left: recordings that fill the disk to its limit, and a long journal."""

import os
import shutil
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from benchmarks.year.calendar import BEGIN, DAY_S
from monitor.alarms import AlarmJournal, AlarmRecord
from rigwatch.wire.messages import Alarm, Column, SampleBlock
from rigwatch.wire.session import SessionWriter, run_info, segment_name

HISTORY_BYTES = (16 << 20) - 20_000
"""Length of a journal that is rotated soon [bytes]."""
SEGMENT_BYTES, WITH_ALARMS = 630e3, 3
"""Size of an earlier recording, that of one of the year's sessions: their number stays what it is
[bytes]. How many there are to one with an alarm."""
FOLDER_DAYS = 6.0
"""Length of a session folder [days]."""
SPAN_DAYS = 400.0
"""The days before the year over which they are spread."""
FILLED = 0.99
"""Part of the disk's limit that they take."""
BLOCK = 4096
ALARM = Alarm(
    "departure", "normal", "error", "the rig no longer behaves as its healthy model", "",
    "rig", 0, 1, 1_700_000_000_000_000_000, 0.0, 0.0, 0.0, False, "", -1,
)  # fmt: skip


def recordings_of_years(root: Path, rig: str, limit: float) -> None:
    """Recordings of a rig that fill a folder almost to its limit [bytes]."""
    root.mkdir(parents=True, exist_ok=True)
    made = [root / f"made-{alarm}.mcap" for alarm in (False, True)]
    for alarm, path in enumerate(made):
        _record(path, alarm=bool(alarm))
    count = int(FILLED * limit / max(path.stat().st_size for path in made))
    for number in range(count):
        ended = BEGIN - (count - number) * SPAN_DAYS * DAY_S / count
        began = datetime.fromtimestamp(ended - ended % (FOLDER_DAYS * DAY_S), UTC)
        folder = root / f"{rig}-{began:%Y%m%dT%H%M%SZ}"
        folder.mkdir(exist_ok=True)
        path = folder / segment_name(1 + number)
        shutil.copyfile(made[number % WITH_ALARMS == 0], path)
        os.utime(path, (ended, ended))
    for path in made:
        path.unlink()


def _record(path: Path, *, alarm: bool) -> None:
    """A closed segment of noise, which is packed to little less."""
    chance = np.random.default_rng(1)
    with SessionWriter(path, run_info("earlier", 256.0, t_ns=1), sync=False) as writer:
        if alarm:
            writer.write(ALARM)
        first = 0
        while writer.size < SEGMENT_BYTES:
            index = np.arange(first, first + BLOCK)
            values = chance.normal(size=BLOCK)
            column = Column("voltage", "V", values, np.zeros(BLOCK, np.uint8))
            writer.write(SampleBlock("rig", 7, first, index, index, (column,)))
            writer.flush()
            first += BLOCK


def journal_of_years(path: Path) -> None:
    """A journal that is almost long enough to be rotated."""
    record = AlarmRecord(ALARM, active=False, latched=False, shelved_until_ns=0, grouped=False,
                         text="of an earlier year")  # fmt: skip
    journal = AlarmJournal(path)
    journal.write([record])
    line = path.stat().st_size
    journal.write([record] * (HISTORY_BYTES // line - 1))
    journal.close()

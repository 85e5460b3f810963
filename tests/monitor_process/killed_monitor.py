"""A monitor that is killed between the journal and the delivery of a change.

python -m tests.monitor_process.killed_monitor CONFIG ALARM STATE

runs `rigwatch monitor`, and at the first change of ALARM to STATE, once it is in the journal and
before anybody hears of it, sends itself SIGKILL.
"""

import os
import signal
import sys

from monitor.alarms import AlarmJournal, AlarmRecord
from monitor.process import run


def main() -> None:
    path, name, state = sys.argv[1:]
    write = AlarmJournal.write

    def write_and_die(journal: AlarmJournal, records: list[AlarmRecord]) -> None:
        write(journal, records)
        if any((one.alarm.name, one.alarm.state) == (name, state) for one in records):
            os.kill(os.getpid(), signal.SIGKILL)

    AlarmJournal.write = write_and_die  # type: ignore[method-assign]
    run(path)


if __name__ == "__main__":
    main()

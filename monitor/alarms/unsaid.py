"""Changes that a killed monitor has journalled and not sent.

An alarm is journalled before it is sent, and what is sent is kept with its number
(`rigwatch/wire/bus/kept_messages.py`). A kill between the two leaves a change that no subscriber
can have heard: the next monitor says it as the end of the run that was killed.
"""

from collections.abc import Collection, Sequence

from monitor.alarms.record import AlarmRecord
from rigwatch.wire.messages import Alarm, encode


def unsaid(records: Sequence[AlarmRecord], said: Collection[bytes]) -> list[Alarm] | None:
    """The changes of state behind the last record that was sent, without those a flood groups.

    Args:
        records: the last ones of the journal, in order.
        said: the alarms that were sent, as bytes.

    Returns:
        None if none of the records was sent: then it is not known where to begin.
    """
    last = max((i for i, one in enumerate(records) if encode(one.alarm) in said), default=None)
    if last is None:
        return None if records else []
    states: dict[str, str] = {}
    found = []
    for number, record in enumerate(records):
        alarm = record.alarm
        changed = states.get(alarm.name, "normal") != alarm.state
        states[alarm.name] = alarm.state
        if number > last and changed and not record.grouped:
            found.append(alarm)
    return found

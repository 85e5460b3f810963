"""An alarm after a restart: its record read back, and what only the old run could end.

A flood and a series of comings are counted in memory: both end with the run. So does an alarm that
the configuration disables now.
"""

from monitor.alarms.actor import Actor
from monitor.alarms.kinds import ALARM_FLOOD, REFINED
from monitor.alarms.record import AlarmRecord
from monitor.alarms.state import AlarmInstance, Occasion


def restore_from(alarm: AlarmInstance, record: AlarmRecord) -> None:
    """Give an alarm the state of its record."""
    said = record.alarm
    alarm.state, alarm.latched = said.state, record.latched
    alarm.shelved_until_ns, alarm.first_out = record.shelved_until_ns, said.first_out
    if alarm.shelved_until_ns:
        alarm.shelved_by = Actor(said.user, said.identity, record.text)
    hidden = record.active and said.state == "normal" and not record.shelved_until_ns
    alarm.superseded = hidden and alarm.settings.enabled and alarm.kind.name in REFINED
    # An alarm that was disabled is raised anew if its condition holds.
    alarm.active = record.active and (alarm.superseded or not hidden)
    alarm.occasion = Occasion(
        said.device, said.boot, said.seq, said.t_ns, said.value, said.low, said.high,
        said.onset_seq, alarm.added_to(said.cause),
    )  # fmt: skip
    alarm.since_ns = said.t_ns


def let_go(alarm: AlarmInstance) -> str:
    """End what only the old run could end; why the state changed, "" if it did not."""
    if not alarm.settings.enabled:
        return "disabled in the configuration" if alarm.dismiss() else ""
    if alarm.name == ALARM_FLOOD:
        alarm.active = False
    return "over since the restart" if not alarm.active and alarm.clear() else ""

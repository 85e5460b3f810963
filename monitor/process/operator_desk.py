"""Executes operators' commands for alarms after verifying who sends them; tells what is shelved."""

from collections.abc import Iterator

from monitor.alarms import AlarmManager, Announcement, bounded
from rigwatch.wire.bus import (
    MOST_COMMANDS,
    Bus,
    CommandCheck,
    ShelvedAlarm,
    command_mark,
    marked,
    taken,
)
from rigwatch.wire.messages import COMMANDS, MONITOR_STALE, AlarmCommand, Event

SOURCE = "monitor/alarms"


class OperatorDesk:
    """The commands that the monitor receives.

    Args:
        bus: source of commands.
        check: verifies them.
    """

    def __init__(self, bus: Bus, check: CommandCheck) -> None:
        self._commands = bus.subscribe(COMMANDS)
        self._check = check

    @property
    def has_some(self) -> bool:
        """Whether commands wait."""
        return len(self._commands) > 0

    @property
    def counters(self) -> dict[str, float]:
        """Commands refused because of their sender, and commands lost in a flood."""
        lost = self._commands.dropped + self._commands.rejected + self._commands.refused
        return {"commands_refused": float(self._check.refused), "commands_lost": float(lost)}

    def execute(
        self, alarms: AlarmManager, now_ns: int, position: tuple[int, int] | None = None
    ) -> Iterator[list[Announcement]]:
        """Execute waiting commands; what to publish for each.

        Args:
            alarms: of the rig.
            now_ns: the monitor's Unix time [ns].
            position: (boot, seq) of the last sample that was judged; None if there was none.
        """
        for command in self._commands.drain(MOST_COMMANDS):
            if command.name != MONITOR_STALE:  # the witness's own alarm
                yield self._executed(alarms, command, now_ns, position)

    def _executed(
        self,
        alarms: AlarmManager,
        command: AlarmCommand,
        now_ns: int,
        position: tuple[int, int] | None,
    ) -> list[Announcement]:
        verdict, kept = self._check.judge(command), bounded(command, now_ns)
        if not verdict.refusal:
            where = [] if position is None else [taken(command, kept, SOURCE, position)]
            return [*where, *marked(alarms.command(kept, verdict.identity), command)]
        text = f"{kept.action} of {kept.name} by {kept.user} refused: {verdict.refusal}"
        mark = command_mark(command)
        return [Event(SOURCE, now_ns, "warning", "alarm_command_refused", f"{text} ({mark})")]


def shelf_of(alarms: AlarmManager) -> list[ShelvedAlarm]:
    """What operators have put aside, as it is told."""
    return [
        ShelvedAlarm(
            one.alarm.name, one.shelved_until_ns, one.alarm.user, one.alarm.identity,
            one.text, one.active,
        )
        for one in alarms.shelved()
    ]  # fmt: skip

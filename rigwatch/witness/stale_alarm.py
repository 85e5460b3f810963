"""The witness's own alarm: the monitor sends no estimates, or is not the only one."""

from collections.abc import Callable, Iterator

from rigwatch.wire.bus import CommandCheck
from rigwatch.wire.messages import (
    EVERY_ALARM,
    LONGEST_NAME,
    MONITOR_STALE,
    Alarm,
    AlarmCommand,
    AlarmState,
    Event,
    Identity,
)
from rigwatch.witness.kept_alarm import KeptAlarm

_NONE = float("nan")
_SILENT = "the monitor sends no estimates"


class StaleAlarm:
    """State of the alarm `monitor_stale`; receives the time and reads no clock.

    Args:
        check: verifies the commands of operators.
        kept: keeps the alarm over restarts.

    Attributes:
        standing: the alarm until estimates come again and somebody has acknowledged it, or None.
    """

    def __init__(self, check: CommandCheck, kept: KeptAlarm | None = None) -> None:
        self._kept = kept or KeptAlarm()
        self.standing = self._kept.read()
        self._check = check

    def judge(  # noqa: PLR0917 -- all that is known
        self,
        stale: bool,
        silent: float,
        t_ns: int,
        why: Callable[[], str] = str,
        doubled: str = "",
        ended: str = "the one monitor is heard again",
    ) -> Iterator[Alarm]:
        """The transition, if there is one.

        Args:
            stale: whether estimates are missing.
            silent: time since the last one [s].
            t_ns: Unix time [ns].
            why: asked for the reason when the alarm is raised; "" if none is known.
            doubled: that several processes call themselves monitor; "" if not.
            ended: why the alarm ends, if it does.
        """
        if (stale or doubled) and not self.holds:
            reason = why()
            silence = f"{_SILENT}: for {silent:.1f} s" + (f"; {reason}" if reason else "")
            yield self._become(_alarm("unacknowledged", silence if stale else doubled, t_ns))
        elif not (stale or doubled) and self.standing is not None and self.holds:
            seen = self.standing.state == "acknowledged"
            state: AlarmState = "normal" if seen else "cleared_unacknowledged"
            yield self._become(_alarm(state, ended, t_ns))

    @property
    def holds(self) -> bool:
        """Whether estimates are missing."""
        return self.standing is not None and self.standing.state != "cleared_unacknowledged"

    def _become(self, alarm: Alarm) -> Alarm:
        self.standing = None if alarm.state == "normal" else alarm
        self._kept.write(self.standing)
        return alarm

    def command(self, command: AlarmCommand, t_ns: int) -> Iterator[Alarm | Event]:
        """Execute an operator's command for this alarm, or say why not."""
        if command.name not in (MONITOR_STALE, EVERY_ALARM):
            return
        why_not = self._obstacle(command)
        # A command for all alarms that does not concern this one is verified by the monitor.
        if why_not and command.name == EVERY_ALARM:
            return
        verdict = self._check.judge(command)
        if why_not := verdict.refusal or why_not:
            user = command.user[:LONGEST_NAME]
            text = f"{command.action} of {command.name} by {user} refused: {why_not}"
            yield Event("witness", t_ns, "warning", "alarm_command_refused", text)
            return
        user = command.user[:LONGEST_NAME]
        state: AlarmState = "acknowledged" if self.holds else "normal"
        yield self._become(_alarm(state, f"{_SILENT}: seen", t_ns, user, verdict.identity))

    def _obstacle(self, command: AlarmCommand) -> str:
        if command.action != "acknowledge":
            return "it can only be acknowledged"
        if self.standing is None or self.standing.state == "acknowledged":
            return "it is not unacknowledged"
        return "" if command.user else "no user given"


def _alarm(
    state: AlarmState, cause: str, t_ns: int, user: str = "", identity: Identity = ""
) -> Alarm:
    return Alarm(
        MONITOR_STALE, state, "critical", cause,
        "The rig is not being watched. Check the monitor's process and its last message, then "
        "data acquisition and router. Where several call themselves monitor, find and end those "
        "that are not the rig's; with keys no other process can be one.",
        "", 0, -1, t_ns, _NONE, _NONE, _NONE, False, user, -1, identity,
    )  # fmt: skip

"""The witness as a process: checks ten times a second and reports.

python -m rigwatch witness CONFIG
"""

import contextlib
import threading
import time

import msgspec

from rigwatch.wire.access import keys_trouble
from rigwatch.wire.bus import (
    MOST_COMMANDS,
    Bus,
    CommandCheck,
    ask_alarm_list,
    joined,
    marked,
    serve_alarm_list,
)
from rigwatch.wire.errors import BusError
from rigwatch.wire.host import Heartbeat, keep_memory_tidy, use_few_pools
from rigwatch.wire.messages import (
    ALARMS,
    COMMANDS,
    ESTIMATES,
    EVENTS,
    HEALTH,
    MONITOR_STALE,
    Alarm,
    Health,
    is_of_structure,
)
from rigwatch.wire.rig_config import RigConfig, SecuritySection, WitnessSection
from rigwatch.witness.announcer import Announcer
from rigwatch.witness.doubles import RESTART, Doubles
from rigwatch.witness.kept_alarm import KeptAlarm, beside_journal
from rigwatch.witness.outputs import Outputs
from rigwatch.witness.said_alarms import SaidAlarms
from rigwatch.witness.silence import Silence
from rigwatch.witness.stale_alarm import StaleAlarm

PROCESS = "witness"
TURN = 0.1
LEAST_SILENCE = 1.0
"""Time without estimates that is an alarm, for a rig of usual rate [s]."""
FOR_MONITOR = 30.0
"""Time allowed until a monitor's first estimate [s]."""

ASKED_AGAIN = 10.0
"""Time after which a monitor that has not told its standing alarms is asked again [s]."""


class Witness:
    """Supervises the monitor of one rig.

    Args:
        settings: section [witness].
        bus: on which the monitor publishes.
        now: monotonic time [s].
        security: section [bus.security].
        kept: keeps the witness's own alarm over restarts.
        said: keeps what it has said for its next run.
        lease: silence after which a link to the router counts as broken [s].
        awaited: whether the rig has a monitor; of one that has none, silence is no alarm before
            a monitor has been heard.

    Raises:
        ConfigError: a heartbeat output or the file of people is invalid.
        MissingExtraError: a package for notifications or the endpoint is not installed.
    """

    def __init__(
        self,
        settings: WitnessSection,
        bus: Bus,
        now: float,
        security: SecuritySection | None = None,
        kept: KeptAlarm | None = None,
        *,
        said: SaidAlarms | None = None,
        lease: float = 10.0,
        awaited: bool = True,
    ) -> None:
        self._security = security = security or SecuritySection()
        self.settings, self._bus = settings, bus
        self._said = said or SaidAlarms(None, None)
        bus.announce(self._said.messages)
        self._announcer = Announcer(settings, bus.rig)
        self._outputs = Outputs(settings, bus, security)
        self._estimates = bus.subscribe_lossy(ESTIMATES)
        self._alarms = bus.listen(ALARMS)
        self._stale_after = settings.stale_after or LEAST_SILENCE
        self._silence = Silence(now + max(0.0, FOR_MONITOR - self._stale_after))
        self._doubles = Doubles(bus, lease + RESTART)
        self._check = CommandCheck(bus, security)
        self._stale = StaleAlarm(self._check, kept)
        # An alarm of an earlier run ends with an estimate, not with the patience for the first.
        self._unheard, self._awaited = self._stale.holds, awaited
        self._commands = bus.subscribe(COMMANDS)
        self._told_at = now - 1.0
        self._knows_standing = False
        self._asked_at = now
        self._learn_standing(now)
        serve_alarm_list(bus, lambda: list(filter(None, [self._stale.standing])))

    def turn(self, now: float, t_ns: int) -> None:
        """Check once; `now` is monotonic time [s], `t_ns` Unix time [ns]."""
        # Of a structure that is watched on the same rig they say nothing about the monitor.
        if not all(map(is_of_structure, self._estimates.drain())):
            self._silence.end(now)
            self._unheard, self._awaited = False, True
            if not self._knows_standing and now - self._asked_at >= ASKED_AGAIN:
                self._learn_standing(now)
        silent = self._silence.counted(now)
        stale = self._awaited and (self._unheard or silent > self._stale_after)
        doubled = self._doubles.text(now)
        why = {} if self._awaited else {"ended": "this rig has no monitor"}
        for alarm in self._stale.judge(stale, silent, t_ns, self._link_trouble, doubled, **why):
            self._bus.publish(ALARMS, alarm)
        self._obey(t_ns)
        for alarm in self._alarms.drain():
            self._hear(alarm, now)
        self._announcer.turn(now, t_ns)
        if now - self._told_at >= 1.0:
            self._told_at = now
            self._report(now, t_ns)

    def _link_trouble(self) -> str:
        """Why nothing is heard: no router, perhaps since certificates have ended."""
        if self._bus.connected():
            return ""
        ended = keys_trouble(self._security, PROCESS)
        return "the router does not answer" + (f": {ended}" if ended else "")

    def _learn_standing(self, now: float) -> None:
        """Ask for the alarms that the monitor raised before this process was there.

        Without an answer, of a monitor that has just started or is held up, it is asked again.
        """
        self._asked_at = now
        with contextlib.suppress(BusError):
            for alarm in ask_alarm_list(self._bus):
                self._hear(alarm, now)
            self._knows_standing = True

    def _hear(self, alarm: Alarm, now: float) -> None:
        self._announcer.hear(alarm, now)
        self._outputs.figures.take_alarm(alarm)

    def _obey(self, t_ns: int) -> None:
        """Execute operators' commands, a few per turn."""
        for command in self._commands.drain(MOST_COMMANDS):
            for said in marked(self._stale.command(command, t_ns), command):
                self._bus.publish(ALARMS if isinstance(said, Alarm) else EVENTS, said)

    def _report(self, now: float, t_ns: int) -> None:
        silent = self._silence.age(now)
        stale = self._stale.holds
        lost = self._commands.dropped + self._commands.rejected + self._commands.refused
        counters = {
            "estimates_silent_s": silent,
            "lost_alarms": float(self._alarms.lost),
            "commands_refused": float(self._check.refused),
            "commands_lost": float(lost),
            "questions_refused": float(self._bus.questions_refused),
            **self._announcer.counters,
            **self._outputs.counters,
        }
        state = MONITOR_STALE if stale else "running"
        trouble = self._announcer.trouble or self._outputs.trouble
        health = Health(PROCESS, t_ns, state, trouble, counters)
        self._bus.publish(HEALTH, health)
        if self._said.messages:
            self._said.messages.write()  # what could not be written before
        self._outputs.renew(now, t_ns, silent, stale=stale)

    def close(self) -> None:
        """Close the connection to the bus."""
        self._outputs.close()
        self._doubles.close()
        self._alarms.close()
        self._estimates.close()
        self._said.close()


def patient(config: RigConfig) -> WitnessSection:
    """The section [witness] with the time that suits the rig's rate."""
    section = config.witness or WitnessSection()
    return msgspec.structs.replace(section, stale_after=config.unwatched_after)


def run(config: RigConfig, stop: threading.Event) -> None:
    """Supervise the rig until `stop` is set.

    Raises:
        BusError: the bus cannot be reached.
    """
    use_few_pools()
    with joined(config, PROCESS, stop) as bus:
        if bus is None:
            return
        path = beside_journal(config)
        kept = KeptAlarm(path)
        witness = Witness(
            patient(config),
            bus,
            time.monotonic(),
            config.bus.security,
            kept,
            said=SaidAlarms(path and path.with_name(f"{path.name}.said"), kept.read()),
            lease=config.bus.lease,
            awaited=config.monitor is not None,
        )
        heartbeat = Heartbeat(PROCESS)
        keep_memory_tidy(stop)
        heartbeat.ready()
        turns = 0
        while not stop.wait(TURN):
            witness.turn(time.monotonic(), time.time_ns())
            turns += 1
            heartbeat.advance(turns)
        heartbeat.stopping()
        witness.close()

"""The witness as a process: checks ten times a second and reports.

python -m rigwatch witness CONFIG
"""

import contextlib
import json
import math
import os
import subprocess
import threading
import time
from dataclasses import asdict
from pathlib import Path

from rigwatch.wire.bus import Bus, CommandCheck, connect, serve_alarm_list
from rigwatch.wire.host import Heartbeat, replace_file
from rigwatch.wire.messages import (
    ALARMS,
    COMMANDS,
    ESTIMATES,
    EVENTS,
    HEALTH,
    MONITOR_STALE,
    Alarm,
    Health,
)
from rigwatch.wire.rig_config import RigConfig, WitnessSection
from rigwatch.witness.notices import Notices
from rigwatch.witness.stale_alarm import StaleAlarm

PROCESS = "witness"
TURN = 0.1
MOST_COMMANDS = 8
"""Commands executed per turn."""
FOR_MONITOR = 30.0
"""Time allowed until a monitor's first estimate [s]."""


class Witness:
    """Supervises the monitor of one rig.

    Args:
        settings: section [witness].
        bus: on which the monitor publishes.
        now: monotonic time [s].
        keys: folder of the rig's keys, "" for none.
    """

    def __init__(self, settings: WitnessSection, bus: Bus, now: float, keys: str = "") -> None:
        self.settings, self._bus = settings, bus
        self._estimates = bus.subscribe_lossy(ESTIMATES)
        self._alarms = bus.listen(ALARMS)
        self._notices = Notices(settings)
        self._heard_at = now + max(0.0, FOR_MONITOR - settings.stale_after)
        self._stale = StaleAlarm(CommandCheck(bus, keys))
        self._commands = bus.subscribe(COMMANDS)
        self._running: list[subprocess.Popen[bytes]] = []
        self._told_at = now - 1.0
        serve_alarm_list(bus, lambda: list(filter(None, [self._stale.standing])))

    def turn(self, now: float, t_ns: int) -> None:
        """Check once; `now` is monotonic time [s], `t_ns` Unix time [ns]."""
        if self._estimates.drain():
            self._heard_at = now
        silent = now - self._heard_at
        for alarm in self._stale.judge(silent > self.settings.stale_after, silent, t_ns):
            self._bus.publish(ALARMS, alarm)
        self._obey(t_ns)
        for alarm in self._alarms.drain():
            self._notify(self._notices.hear(alarm, now))
        self._notify(self._notices.due(now))
        if now - self._told_at >= 1.0:
            self._told_at = now
            self._report(silent, t_ns)

    def _obey(self, t_ns: int) -> None:
        """Execute operators' commands, a few per turn."""
        for _ in range(MOST_COMMANDS):
            command = self._commands.get(timeout=0)
            if command is None:
                return
            for said in self._stale.command(command, t_ns):
                self._bus.publish(ALARMS if isinstance(said, Alarm) else EVENTS, said)

    def _notify(self, alarms: list[Alarm]) -> None:
        """Start the command for each alarm without waiting for it."""
        self._running = [one for one in self._running if one.poll() is None]
        for alarm in alarms if self.settings.notify else ():
            with contextlib.suppress(OSError):
                self._start(alarm)

    def _start(self, alarm: Alarm) -> None:
        fields = {
            key: None if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in asdict(alarm).items()
        }
        started = subprocess.Popen(
            [*self.settings.notify, alarm.name, alarm.severity, alarm.cause],
            stdin=subprocess.PIPE,
            env={**os.environ, "RIGWATCH_RIG": self._bus.rig},
        )
        assert started.stdin is not None
        with contextlib.suppress(BrokenPipeError), started.stdin as pipe:
            pipe.write(json.dumps(fields).encode())
        self._running.append(started)

    def _report(self, silent: float, t_ns: int) -> None:
        state = MONITOR_STALE if self._stale.standing else "running"
        counters = {"estimates_silent_s": max(0.0, silent), "lost_alarms": float(self._alarms.lost)}
        self._bus.publish(HEALTH, Health(PROCESS, t_ns, state, "", counters))
        if self.settings.heartbeat_file and not self._stale.standing:
            self._beat(Path(self.settings.heartbeat_file), t_ns)

    def _beat(self, path: Path, t_ns: int) -> None:
        """Update the heartbeat file, whose age shows when the monitor last published."""
        with contextlib.suppress(OSError):
            text = f"{t_ns / 1e9:.3f} {self._bus.rig} running\n"
            replace_file(path, text, durable=False)

    def close(self) -> None:
        """Close the connection to the bus."""
        self._alarms.close()
        self._estimates.close()


def run(config: RigConfig, stop: threading.Event) -> None:
    """Supervise the rig until `stop` is set.

    Raises:
        BusError: the bus cannot be reached.
    """
    bus = connect(config, PROCESS)
    try:
        witness = Witness(
            config.witness or WitnessSection(),
            bus,
            time.monotonic(),
            config.bus.security.keys,
        )
        heartbeat = Heartbeat(PROCESS)
        heartbeat.ready()
        turns = 0
        while not stop.wait(TURN):
            witness.turn(time.monotonic(), time.time_ns())
            turns += 1
            heartbeat.advance(turns)
        heartbeat.stopping()
        witness.close()
    finally:
        bus.close()

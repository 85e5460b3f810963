"""Random kills and hangs of a supervised rig for two hours: nothing is missing without a report.

    rigwatch up ─▶ router, plant, daq, monitor, recorder, witness
         ▲ SIGKILL, or SIGSTOP and SIGCONT after 0.2 to 6 s, 1000 in two hours
         └ this process ─▶ two listeners, an operator who acknowledges and resets

The rig is that of the demonstration, whose faults come and go, so that there are alarms of the rig
besides those of the kills. Afterwards the recording, the alarm journal and what both listeners
heard are compared (`random_kills_accounts.py`).
"""

import contextlib
import os
import random
import shutil
import signal
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.processes.live_rig import LiveRig, Statuses, live_rig
from benchmarks.processes.random_kills_accounts import Account, accounts_of
from rigwatch.wire.bus import Bus, command_alarms, connect
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import ALARMS, SAMPLES, AlarmCommand, Event
from rigwatch.wire.session import SessionWriter, run_info
from tests.tooling.test_up import Rig as Up
from tools.benchmark_table import Row

VICTIMS = ("plant", "router", "daq", "monitor", "recorder", "witness")
MEAN_PAUSE = float(os.environ.get("RIGWATCH_KILL_PAUSE", "5.5"))
"""Mean pause before a kill or hang [s]; with the hangs themselves, a thousand in two hours."""
LISTENERS = ("listener-1", "listener-2")
SETTLING = 45.0
"""Time without kills at the end, so that what was missed can be fetched [s]."""
FIRST = 60.0
"""Longest start of all processes [s]."""


class Listener:
    """A subscriber that lives for the whole run and keeps what it hears in a session.

    Of the samples it keeps what happens to reach it, as a witness of what was sent.

    Args:
        bus: source of the alarms and samples.
        folder: of the session.
    """

    def __init__(self, bus: Bus, folder: Path) -> None:
        self.bus = bus
        path = folder / f"{bus.process}.mcap"
        self._samples = bus.subscribe_lossy(SAMPLES)
        self._alarms = bus.listen(ALARMS, gaps_in_place=True)
        self._heard = SessionWriter(path, run_info(bus.rig, 1.0))

    def run(self, stop: threading.Event) -> None:
        """Listen until `stop` is set."""
        while not stop.is_set():
            said = self._alarms.get(timeout=0.1)
            for one in [*([said] if said else []), *self._samples.drain()]:
                self._heard.write(one)
        ended_ns = time.time_ns()
        for said in self._alarms.drain():
            self._heard.write(said)
        self._heard.write(Event(self.bus.process, ended_ns, "info", "ENDED", ""))
        self._heard.close()


@dataclass
class Disturbance:
    """What was done to the rig."""

    kills: dict[str, int] = field(default_factory=lambda: dict.fromkeys(VICTIMS, 0))
    hangs: dict[str, int] = field(default_factory=lambda: dict.fromkeys(VICTIMS, 0))
    commands: int = 0
    refused: int = 0

    @property
    def count(self) -> int:
        """Kills and hangs together."""
        return sum(self.kills.values()) + sum(self.hangs.values())

    def __str__(self) -> str:
        each = ", ".join(f"{name} {self.kills[name]}+{self.hangs[name]}" for name in VICTIMS)
        return f"killed + stopped: {each}"


def run(quick: bool) -> list[Row]:
    """Two minutes, or as many as RIGWATCH_KILL_MINUTES says (default 120).

    RIGWATCH_KILL_PAUSE is the mean pause before a kill [s], RIGWATCH_KILL_FOLDER gets a copy of
    what was recorded and heard.
    """
    minutes = 2.0 if quick else float(os.environ.get("RIGWATCH_KILL_MINUTES", "120"))
    with live_rig() as rig:
        done, left = disturbed(rig, 60.0 * minutes)
        if kept := os.environ.get("RIGWATCH_KILL_FOLDER"):
            shutil.copytree(rig.folder, kept, ignore=shutil.ignore_patterns("serial-line"))
        accounts = accounts_of(rig.folder)
    return [_alive(left, done, minutes), *map(_row, accounts)]


def _alive(left: list[str], done: Disturbance, minutes: float) -> Row:
    what = f"{done.count} random kills and hangs in {minutes:g} min: processes at the end"
    text = "all run" if not left else f"{', '.join(left)} not"
    refused = f"{done.commands} commands of an operator, {done.refused} answered with a refusal"
    return Row(what, text, "all run", "", f"{done}; {refused}", passed=not left)


def _row(account: Account) -> Row:
    return Row(
        f"the same: {account.what}",
        f"{account.missing} silently missing",
        "0",
        "",
        account.note,
        passed=account.missing == 0 and account.total > 0,
    )


def disturbed(rig: LiveRig, seconds: float) -> tuple[Disturbance, list[str]]:
    """Run and disturb the rig; the processes that do not run at the end."""
    with rig.path.open("a") as file:
        file.write("\n[witness]\n")
    up, stop = Up(rig.path, "--without", "dashboard"), threading.Event()
    try:
        statuses = Statuses(up)
        statuses.wait(VICTIMS, FIRST)
        listeners = [Listener(connect(rig.config, name, FIRST), rig.folder) for name in LISTENERS]
        threads = [threading.Thread(target=one.run, args=(stop,)) for one in listeners]
        for thread in threads:
            thread.start()
        done = Disturbance()
        operator = threading.Thread(target=_operate, args=(rig, stop, done))
        operator.start()
        _disturb(statuses, done, seconds)
        time.sleep(SETTLING)
        stop.set()
        operator.join()
        for thread in threads:
            thread.join()
        left = [name for name in VICTIMS if not statuses.alive(name)]
        for one in listeners:
            one.bus.close()
    finally:
        stop.set()
        up.end()
    return done, left


def _disturb(statuses: Statuses, done: Disturbance, seconds: float) -> None:
    chance, ends = random.Random(1), time.monotonic() + seconds
    time.sleep(10.0)
    while (left := ends - time.monotonic()) > 0:
        time.sleep(min(left, chance.expovariate(1.0 / MEAN_PAUSE)))
        name = chance.choice(VICTIMS)
        if not statuses.alive(name):
            continue
        pid = int(statuses.of(name)["pid"])
        with contextlib.suppress(ProcessLookupError):
            if chance.random() < 0.6:
                os.kill(pid, signal.SIGKILL)
                done.kills[name] += 1
            else:
                os.kill(pid, signal.SIGSTOP)
                done.hangs[name] += 1
                time.sleep(chance.uniform(0.2, 6.0))
                os.kill(pid, signal.SIGCONT)


def _operate(rig: LiveRig, stop: threading.Event, done: Disturbance) -> None:
    """Acknowledge and reset all alarms twice a minute."""
    while not stop.wait(15.0):
        for action in ("acknowledge", "reset"):
            with contextlib.suppress(RigwatchError):
                bus = connect(rig.config, "operator-desk", 3.0)
                try:
                    command = AlarmCommand("*", action, "benchmark", time.time_ns())
                    done.refused += bool(command_alarms(bus, command).refusal)
                    done.commands += 1
                finally:
                    bus.close()

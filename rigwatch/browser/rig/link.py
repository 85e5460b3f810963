"""The page's connection to a rig's bus; it reconnects when the rig restarts."""

import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from monitor.model import load_model
from rigwatch.browser.rig.faults import Faults
from rigwatch.browser.rig.live_view import LiveView
from rigwatch.wire.bus import (
    Bus,
    CommandAnswer,
    ask_alarm_list,
    ask_shelf,
    command_alarms,
    connect,
    unique_process,
)
from rigwatch.wire.errors import BusError, RigwatchError
from rigwatch.wire.messages import ALARMS, ESTIMATES, HEALTH, SAMPLES, Alarm, AlarmCommand
from rigwatch.wire.rig_config import load_rig
from rigwatch.workbench.steps import model_path

TIMEOUT = 2.0
ASK_EVERY = 2.0
"""Time between questions for the standing alarms [s]."""
TURN = 0.1
"""Time between two reads of the bus [s]."""


class RigLink:
    """Subscribes to a rig.

    Args:
        path: the rig's configuration.

    Attributes:
        looked_at: end of the last look at the bus, monotonic time [s].

    Raises:
        ConfigError: it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.config = path, load_rig(path)
        self._live = LiveView(self.config.rig.sample_rate)
        self._trouble = "connecting to the rig"
        self.looked_at = time.monotonic()
        self._learns = _learns(path)
        self._faults = Faults("the page's link to the rig")
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="rig", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop receiving."""
        self._ended.set()
        self._thread.join(TIMEOUT)

    def signals(self, since: int) -> tuple[int, dict[str, Any]]:
        """Signals received after the part `since`, and the number of the newest part."""
        with self._lock:
            return self._live.signals(since)

    def status(self) -> dict[str, Any]:
        """Alarms and states, and the fault of the link, if any."""
        with self._lock:
            states = self._live.states(time.monotonic(), self._learns)
            return {
                "rig": self.config.rig.id,
                "trouble": self._trouble,
                "alarms": self._live.alarms(),
                "shelf": self._live.shelf(),
                **states,
            }

    def alarm(self, name: str) -> Alarm | None:
        """A received alarm."""
        with self._lock:
            return self._live.alarm(name)

    def command(self, command: AlarmCommand) -> CommandAnswer:
        """Send an operator's command and collect what is said to it.

        Raises:
            BusError: no monitor answers.
        """
        bus = connect(self.config, unique_process("workbench-ack"), TIMEOUT)
        try:
            return command_alarms(bus, command)
        finally:
            bus.close()

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                self._joined()
                continue
            except RigwatchError as error:  # no router, or keys that cannot be read
                self._say(str(error))
            except Exception as error:  # the page goes on, whatever it is
                self._say(self._faults.told(error))
            self.looked_at = time.monotonic()
            self._ended.wait(TIMEOUT)

    def _joined(self) -> None:
        """Listen until the router is gone."""
        bus = connect(self.config, unique_process("workbench"), TIMEOUT)
        try:
            self._listen(bus)
        finally:
            bus.close()

    def _listen(self, bus: Bus) -> None:
        topics = (ALARMS, SAMPLES, ESTIMATES, HEALTH)
        subscriptions = [bus.subscribe(topic) for topic in topics]
        again = 0.0
        while not self._ended.is_set() and bus.connected():
            if time.monotonic() >= again:
                self._ask(bus)
                again = time.monotonic() + ASK_EVERY
            heard = [one for subscription in subscriptions for one in subscription.drain()]
            with self._lock:
                for message in heard:
                    self._live.take(message, time.monotonic())
            self.looked_at = time.monotonic()
            self._ended.wait(TURN)
        self._say("the rig's router is gone; waiting for it")

    def _ask(self, bus: Bus) -> None:
        """Take the standing alarms, whose probable causes are found late, and the shelved ones."""
        try:
            standing = ask_alarm_list(bus, 0.3)
        except BusError as error:
            self._say("" if self._live.hears(time.monotonic()) else str(error))
            return
        with self._lock:
            self._live.standing(standing)
            self._trouble = ""
        # The witness answers for the list without a monitor; then nothing has left the shelf.
        with suppress(BusError):
            shelved = ask_shelf(bus, 0.3)
            with self._lock:
                self._live.shelve(shelved)
                self._live.only(standing)  # the monitor answers: its list is in it

    def _say(self, trouble: str) -> None:
        with self._lock:
            self._trouble = trouble


def _learns(path: Path) -> float:
    """Time that the monitor needs before it watches [s]; 0 if its model cannot be read."""
    try:
        model = load_model(model_path(path))
    except RigwatchError:
        return 0.0
    return (model.decision.settle + model.decision.learn) / model.sample_rate

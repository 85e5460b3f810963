"""The demonstration: `rigwatch up` runs the rig, and events are reported as they happen."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigwatch.demo.commissioning import known_friction
from rigwatch.demo.narrator import Narrator
from rigwatch.demo.rig_file import relative
from rigwatch.demo.verdict import Recording, complaints, read_recording
from rigwatch.recorder import newest
from rigwatch.wire.bus import connect, unique_process
from rigwatch.wire.errors import DeviceError
from rigwatch.wire.host import end_process
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    EVENTS,
    SAMPLES,
    Alarm,
    EstimateBlock,
    Event,
    SampleBlock,
)
from rigwatch.wire.rig_config import load_rig
from sim_plant.scenario import load_scenario

START_TIMEOUT = 180.0
STOP_TIMEOUT = 60.0
SUCCEEDED = "the demo succeeded: the friction was named, and every sample is in the recording"
UNEXPLAINED = "  (it ended before the monitor had said what is missing in the rig's model)"
GO_ON = (
    "on to your own machine (README.md, Your own machine):",
    "  models, which are equations to be fitted:  rigwatch model list",
    "  one of them beside your logs:              rigwatch study new NAME --data LOG --model MODEL",
    "  a rig to be watched, from example files:   rigwatch init     (then docs/operations.md)",
)
"""What to do after the demonstration."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a demonstration.

    Attributes:
        alarms: raised during it.
        recording: what the recorder kept of it.
        complaints: why it failed; empty if it succeeded.
        exit_code: of `rigwatch up`.
    """

    alarms: tuple[Alarm, ...]
    recording: Recording
    complaints: tuple[str, ...]
    exit_code: int

    def as_dict(self) -> dict[str, Any]:
        """The result as plain values, for `--json`."""
        return {
            "recording": str(self.recording.path),
            "samples": self.recording.samples,
            "alarms": [{"name": a.name, "seq": a.seq, "cause": a.cause} for a in self.alarms],
            "complaints": list(self.complaints),
        }


def not_activated() -> str:
    """The script that puts this virtual environment's commands on the path, "" if none need."""
    script = Path(sys.prefix) / "bin" / "activate"
    in_use = "VIRTUAL_ENV" in os.environ or not script.is_file()
    return "" if in_use else relative(script)


class Show:
    """One run of the demonstration.

    Args:
        rig: configuration of the rig.
        folder: its files.
        say: called with lines for people.
        attended: people watch until they end it, and can give commands.
        workbench: gives the address of the workbench, empty without one.
    """

    def __init__(
        self,
        rig: Path,
        folder: Path,
        say: Callable[[str], None],
        *,
        attended: bool = True,
        workbench: Callable[[], str] = str,
    ) -> None:
        self._rig, self._folder, self._say = rig, folder, say
        self._config = load_rig(rig)
        assert self._config.plant is not None
        scenario = load_scenario(self._config.plant.scenario)
        self._narrator = Narrator(
            scenario,
            say,
            relative(self._rig),
            relative(folder / "studies"),
            known=known_friction(),
            attended=attended,
            workbench=workbench,
        )
        self._first = self._seen = 0
        self._up: subprocess.Popen[str] | None = None

    def play(self, seconds: float, after_named: float) -> Outcome:
        """Run, then judge the recording.

        Args:
            seconds: longest rig time; Ctrl-C ends it too [s].
            after_named: longest time from the naming of dry friction to the end, which comes
                earlier if the monitor has said what its model lacks [s].
        """
        self._say(f"starting the rig: $ rigwatch up {relative(self._rig)}")
        if activate := not_activated():
            self._say(f"            (for commands in another terminal: $ . {activate})")
        self._up = subprocess.Popen(
            [sys.executable, "-m", "rigwatch", "up", str(self._rig), "--json"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            process_group=0,
        )
        threading.Thread(target=self._relay, name="relay", daemon=True).start()
        try:
            with suppress(KeyboardInterrupt):
                self._watch(seconds, after_named)
        finally:
            self._stop()
        return self._judge()

    def _watch(self, seconds: float, after_named: float) -> None:
        bus = connect(self._config, unique_process("demo"))
        samples, estimates = bus.subscribe(SAMPLES), bus.subscribe(ESTIMATES)
        alarms, events = bus.subscribe(ALARMS), bus.subscribe(EVENTS)
        rate = self._config.rig.sample_rate
        give_up = time.monotonic() + START_TIMEOUT
        try:
            while self._seen < min(seconds, self._narrator.all_told_at(after_named)) * rate:
                self._check_running(give_up)
                alarm: Alarm | None = alarms.get(timeout=0.1)
                # A missing device is not reported before the simulated device is up.
                if alarm is not None and self._seen:
                    self._narrator.alarm(alarm)
                told: list[Event] = events.drain()
                for event in told:
                    self._narrator.explain(event)
                judged: list[EstimateBlock] = estimates.drain()
                if judged and alarm is None:
                    self._narrator.judged(judged[-1])
                blocks: list[SampleBlock] = samples.drain()
                if blocks:
                    self._take(blocks)
                    give_up = time.monotonic() + START_TIMEOUT
        finally:
            bus.close()

    def _take(self, blocks: list[SampleBlock]) -> None:
        if not self._seen:
            self._say("samples arrive: the rig moves, healthy so far")
            self._first = blocks[0].seq
            self._narrator.begin(self._first)
        self._seen = blocks[-1].seq + len(blocks[-1])
        self._narrator.samples(self._seen)

    def _check_running(self, give_up: float) -> None:
        assert self._up is not None
        if self._up.poll() is not None:
            raise DeviceError(f"rigwatch up ended with code {self._up.returncode}")
        if time.monotonic() > give_up:
            raise DeviceError(f"no samples for {START_TIMEOUT:g} s")

    def _relay(self) -> None:
        """Pass on the supervisor's events that matter to people."""
        assert self._up is not None
        assert self._up.stdout is not None
        for line in self._up.stdout:
            try:
                event = json.loads(line)
            except ValueError:
                self._say(line.rstrip())
                continue
            if event["event"] in ("says", "ill", "ended", "restarting"):
                self._say(f"  {event['process']}: {event['text']}")

    def _stop(self) -> None:
        assert self._up is not None
        if self._up.poll() is not None:
            return
        self._say("stopping the rig; the recording is closed")
        # A second Ctrl-C must not leave a half written file behind.
        previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            end_process(self._up, STOP_TIMEOUT)
        finally:
            signal.signal(signal.SIGINT, previous)

    def _judge(self) -> Outcome:
        recording = read_recording(newest(self._folder / "sessions", self._config.rig.id))
        assert self._up is not None
        code = self._up.returncode
        seen = range(self._first, self._seen)
        found = complaints(
            self._narrator.alarms, recording, seen,
            exit_code=code, fault_begun=self._narrator.fault_begun,
        )  # fmt: skip
        seconds = recording.samples / self._config.rig.sample_rate
        whole = "; ".join(recording.faults) or "none missing"
        session = relative(recording.path)
        self._narrator.end()
        self._say(f"recording: {session}, {recording.samples} samples ({seconds:.0f} s), {whole}")
        for complaint in found:
            self._say(f"the demo did not succeed: {complaint}")
        if not found:
            self._say(SUCCEEDED)
            if not self._narrator.explained:
                self._say(UNEXPLAINED)
        self._say(f"look into it:  rigwatch info {session}")
        self._say(f"replay it:     rigwatch replay {session}")
        self._say("               (the same monitor over the recording; it finds the same)")
        for line in GO_ON:
            self._say(line)
        return Outcome(tuple(self._narrator.alarms), recording, tuple(found), code)

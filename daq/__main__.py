"""The acquisition process: device ─▶ adapter ─▶ acquisition ─▶ bus and ring.

Started by `rigwatch daq CONFIG` or `python -m daq CONFIG`.
"""

import sys
import threading
import time
from pathlib import Path

from daq.acquisition import Acquisition
from daq.adapter import Adapter
from daq.adapters import adapter_for
from daq.device_desk import DeviceDesk
from daq.known_device import KnownDevice, device_file
from daq.publisher import Publisher
from daq.supervisor import Supervisor
from daq.turns import Turns
from daq.watch import Link
from rigwatch.wire.bus import Bus, joined
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import (
    DAQ,
    DEVICE_SILENT,
    NO_SAMPLES,
    Heartbeat,
    Pulse,
    prepare_for_real_time,
    raise_priority,
    set_at_signal,
    unless_ended,
)
from rigwatch.wire.rig_config import RigConfig, load_rig


class Chain:
    """One rig from its device to the bus; `step` takes what has come one link further.

    Args:
        config: the rig's configuration.
        adapter: its device, not opened yet.
        bus: destination of its samples.
        pulse: told of each step.
    """

    def __init__(self, config: RigConfig, adapter: Adapter, bus: Bus, pulse: Pulse) -> None:
        self.device = Supervisor(adapter)
        self.acquisition = Acquisition(config, adapter.clock_rate)
        self._publisher = Publisher(bus, SampleRing(bus, config.daq.ring))
        self._adapter, self._pulse, self._bus = adapter, pulse, bus
        self._known = _checked(config, adapter, self.acquisition.source)
        self._desk = DeviceDesk(bus, self._known, config.bus.security) if self._known else None

    def step(self, wait: float) -> None:
        """Read for at most `wait` [s] and publish what comes of it."""
        for raw in self.device.read(wait):
            self._publisher.publish(self.acquisition.update(raw))
        link, counters = self.device.link, self._adapter.counters()
        if self._known and self._desk:
            self._publisher.publish(self._known.events())
            counters = {**counters, **self._desk.counters}
        counters = {**counters, "questions_refused": float(self._bus.questions_refused)}
        self._publisher.publish(self.acquisition.tick(time.monotonic_ns(), link, counters))
        self._pulse.advance(self.acquisition.samples, _waits(link, self.acquisition.watch.state))


def _waits(link: Link, state: str) -> str:
    """Why no samples come of the device, whose line a start anew would only open again."""
    if not link.connected or link.text:
        return link.text or "the device is not open"
    return NO_SAMPLES if state in DEVICE_SILENT else ""


def _checked(config: RigConfig, adapter: Adapter, source: str) -> KnownDevice | None:
    """The rig's device as it is known, which the adapter checks; None where nothing is checked."""
    check_against = getattr(adapter, "check_against", None)
    named = getattr(config.daq.device, "identity", "")
    if check_against is None or named or config.daq.any_device:
        return None
    known = KnownDevice(source, device_file(config))
    check_against(known)
    return known


def acquire(
    config: RigConfig,
    adapter: Adapter,
    bus: Bus,
    stop: threading.Event,
    pulse: Pulse,
    *,
    turns: Turns | None = None,
) -> None:
    """Acquire until `stop` is set.

    Args:
        config, adapter, bus, pulse: of the rig's `Chain`.
        stop: ends the loop.
        turns: those of the process, if it serves several rigs: the device is read once a turn, and
            in their thread if it never waits; otherwise samples are passed on as they come.

    Raises:
        DeviceBusyError: another process holds the device.
    """
    chain = Chain(config, adapter, bus, pulse)
    at_once = turns is not None and getattr(adapter, "at_once", False)

    def in_turns() -> bool:
        chain.step(0.0)
        return chain.device.connected and not stop.is_set()

    chain.device.start()
    pulse.ready()
    try:
        while not stop.is_set():
            if turns is not None and at_once and chain.device.connected:
                turns.serve(in_turns)
                continue
            chain.step(chain.acquisition.patience(time.monotonic_ns()))
            if turns is not None:
                time.sleep(turns.turn - time.monotonic() % turns.turn)
        pulse.stopping()
    finally:
        chain.device.close()


def run(path: Path | str, stop: threading.Event) -> None:
    """Acquire as configured at `path`, until `stop` is set.

    Raises:
        ConfigError: the configuration is wrong.
        DeviceError: the adapter is not installed, or another process holds the device.
    """
    config = load_rig(path)
    adapter = unless_ended(stop, lambda: _prepared(config))
    raise_priority(DAQ)
    with joined(config, "daq", stop) as bus:
        prepare_for_real_time()
        if bus is not None:
            acquire(config, adapter, bus, stop, Heartbeat("daq"))


def _prepared(config: RigConfig) -> Adapter:
    """The rig's adapter, with all kernels compiled that its samples need."""
    adapter = adapter_for(config.daq.device, config.channels)
    Acquisition(config, adapter.clock_rate)
    return adapter


def main(path: Path | str) -> int:
    """`run` until a signal ends it; the exit code."""
    run(path, set_at_signal())
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1]))
    except RigwatchError as error:
        sys.exit(f"daq: {error}")

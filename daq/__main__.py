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
from daq.publisher import Publisher
from daq.supervisor import Supervisor
from daq.turns import Turns
from rigwatch.wire.bus import Bus, connect
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import (
    DAQ,
    Heartbeat,
    Pulse,
    prepare_for_real_time,
    raise_priority,
    set_at_signal,
)
from rigwatch.wire.rig_config import RigConfig, load_rig


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
        config: the rig's configuration.
        adapter: its device, not opened yet.
        bus: destination of its samples.
        stop: ends the loop.
        pulse: told of each turn.
        turns: those of the process, if it serves several rigs: the device is read once a turn, and
            in their thread if it never waits; otherwise samples are passed on as they come.

    Raises:
        DeviceBusyError: another process holds the device.
    """
    device = Supervisor(adapter)
    acquisition = Acquisition(config, adapter.clock_rate)
    publisher = Publisher(bus, SampleRing(bus, config.daq.ring))
    at_once = turns is not None and getattr(adapter, "at_once", False)

    def step(wait: float) -> None:
        for raw in device.read(wait):
            publisher.publish(acquisition.update(raw))
        link, counters = device.link, adapter.counters()
        publisher.publish(acquisition.tick(time.monotonic_ns(), link, counters))
        pulse.advance(acquisition.samples)

    def in_turns() -> bool:
        step(0.0)
        return device.connected and not stop.is_set()

    device.start()
    pulse.ready()
    try:
        while not stop.is_set():
            if turns is not None and at_once and device.connected:
                turns.serve(in_turns)
                continue
            step(acquisition.patience(time.monotonic_ns()))
            if turns is not None:
                time.sleep(turns.turn - time.monotonic() % turns.turn)
        pulse.stopping()
    finally:
        device.close()


def run(path: Path | str, stop: threading.Event) -> None:
    """Acquire as configured at `path`, until `stop` is set.

    Raises:
        ConfigError: the configuration is wrong.
        DeviceError: the adapter is not installed, or another process holds the device.
    """
    config = load_rig(path)
    adapter = adapter_for(config.daq.device, config.channels)
    raise_priority(DAQ)
    bus = connect(config, "daq")
    prepare_for_real_time()
    try:
        acquire(config, adapter, bus, stop, Heartbeat("daq"))
    finally:
        bus.close()


def main(path: Path | str) -> int:
    """`run` until a signal ends it; the exit code."""
    run(path, set_at_signal())
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1]))
    except RigwatchError as error:
        sys.exit(f"daq: {error}")

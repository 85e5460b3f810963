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
from daq.chain import Chain
from rigwatch.wire.bus import Bus, joined
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import (
    DAQ,
    Heartbeat,
    Pulse,
    Turns,
    prepare_for_real_time,
    raise_priority,
    set_at_signal,
    unless_ended,
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
                turns.serve(in_turns, chain)
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

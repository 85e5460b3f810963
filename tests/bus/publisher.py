"""Publishes samples as daq does: into the ring, then onto the bus. A process that tests kill.

python -m tests.bus.publisher CONFIG BOOT [--ring N] [--rate HZ] [--wave] [--twice N] [--desk FILE]
"""

import argparse
import time
from pathlib import Path

import numpy as np

from daq.device_desk import DeviceDesk
from daq.known_device import KnownDevice
from rigwatch.wire.bus.connection import connect
from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.messages.message_types import Column, Health, SampleBlock
from rigwatch.wire.messages.topics import HEALTH, SAMPLES
from rigwatch.wire.rig_config import load_rig
from tests.bus.samples import block

DEVICE, OTHER = "pump 1", "pump 2"
"""The device of a rig with a desk, and the one that answers in its place and is refused."""


def wave(seq: int, n: int, boot: int, t_ns: int) -> SampleBlock:
    """A rig driven by an 8 Hz sine, as far as a monitor can tell from kinematics."""
    numbers = np.arange(seq, seq + n)
    phase = 2 * np.pi * 8.0 * numbers / 256.0
    noise = np.random.default_rng([boot, seq]).normal(0.0, 1e-3, n)
    values = {
        "voltage": ("V", 1.4 * np.sin(phase)),
        "position": ("m", 0.006 * np.sin(phase)),
        "acceleration": ("m/s^2", -0.006 * (2 * np.pi * 8.0) ** 2 * np.sin(phase) + noise),
    }
    channels = tuple(
        Column(name, unit, column, np.zeros(n, np.uint8)) for name, (unit, column) in values.items()
    )
    return SampleBlock("rig", boot, seq, numbers * 3906, t_ns + numbers * 3_906_250, channels)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("config")
    parser.add_argument("boot", type=int)
    parser.add_argument("--ring", type=int, default=65536)
    parser.add_argument("--rate", type=float, default=256.0)
    parser.add_argument("--wave", action="store_true")
    parser.add_argument("--twice", type=int, default=0, help="send every Nth sample again")
    parser.add_argument("--desk", type=Path, help="answer requests about a device kept there")
    arguments = parser.parse_args()
    config = load_rig(arguments.config)
    bus = connect(config, "daq")
    desk = None
    if arguments.desk:
        known = KnownDevice("daq/rig", arguments.desk)
        assert known.admits(DEVICE)
        assert not known.admits(OTHER)
        desk = DeviceDesk(bus, known, config.bus.security)
    ring = SampleRing(bus, arguments.ring)
    start, start_ns = time.monotonic(), time.time_ns()
    sent = 0
    while True:
        due = int((time.monotonic() - start) * arguments.rate) + 1
        if sent == 0 or sent // 256 < due // 256:
            counters = desk.counters if desk else {}
            bus.publish(HEALTH, Health("daq/rig", time.time_ns(), "running", "", counters))
        for seq in range(sent, due):
            make = wave if arguments.wave else block
            part = make(seq, 1, arguments.boot, start_ns)
            ring.add(part)
            bus.publish(SAMPLES, part)
            if arguments.twice and seq % arguments.twice == 0:
                bus.publish(SAMPLES, part)
        sent = due
        time.sleep(max(0.0, start + sent / arguments.rate - time.monotonic()))


if __name__ == "__main__":
    main()

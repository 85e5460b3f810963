"""Publishes as a rig's daq and monitor do, with small rings. A process that tests cut off.

python -m tests.sites.source CONFIG RATE [--boot BOOT]
"""

import argparse
import time

import numpy as np

from rigwatch.wire.bus.connection import connect
from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.messages.message_types import Alarm, Column, EstimateBlock, Event
from rigwatch.wire.messages.topics import ALARMS, ESTIMATES, EVENTS, SAMPLES
from rigwatch.wire.rig_config import load_rig
from tests.bus.samples import block

BLOCK = 8
FIELDS = 20


def estimates(seq: int, boot: int, t_ns) -> EstimateBlock:
    """Estimates of the samples from `seq` on, whose values can be told from their number."""
    noise = np.random.default_rng([boot, seq]).normal(size=(FIELDS, len(t_ns)))
    columns = tuple(Column(f"field{n}", "", noise[n]) for n in range(FIELDS))
    return EstimateBlock("rig", boot, seq, t_ns, columns)


def alarm(seq: int, boot: int, t_ns: int) -> Alarm:
    nan = float("nan")
    return Alarm(
        "gap", "normal", "info", "", "", "rig", boot, seq, t_ns, nan, nan, nan, False, "", seq
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("config")
    parser.add_argument("rate", type=float)
    parser.add_argument("--boot", type=int, default=7)
    arguments = parser.parse_args()
    config = load_rig(arguments.config)
    daq, monitor = connect(config, "daq"), connect(config, "monitor")
    ring = SampleRing(daq, config.daq.ring)
    start, start_ns = time.monotonic(), time.time_ns()
    sent = 0
    while True:
        due = int((time.monotonic() - start) * arguments.rate) + 1
        for seq in range(sent, due - BLOCK, BLOCK):
            part = block(seq, BLOCK, arguments.boot, start_ns, 1e9 / arguments.rate)
            ring.add(part)
            daq.publish(SAMPLES, part)
            monitor.publish(ESTIMATES, estimates(seq, part.boot, part.t_ns))
            if seq % 512 == 0:
                t_ns = int(part.t_ns[0])
                monitor.publish(ALARMS, alarm(seq, part.boot, t_ns))
                monitor.publish(EVENTS, Event("monitor", t_ns, "info", "BEAT", f"at {seq}"))
            sent = seq + BLOCK
        time.sleep(0.02)


if __name__ == "__main__":
    main()

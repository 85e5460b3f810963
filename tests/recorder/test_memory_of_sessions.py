"""What a recorder and a witness hold stays the same over hundreds of sessions of a rig."""

import gc
import tracemalloc
from pathlib import Path

from rigwatch.recorder.process import Recorder, describe_run
from rigwatch.wire.bus import Bus
from rigwatch.wire.bus.memory_transport import MemoryNetwork, MemoryTransport
from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.messages import ALARMS, EVENTS, HEALTH, SAMPLES, Event, Health
from rigwatch.wire.rig_config import WitnessSection
from rigwatch.witness.process import Witness
from tests.bus.rig import TestRig
from tests.bus.samples import block
from tests.bus.test_complete_subscription import alarm

FEW, MANY = 100, 130
"""Numbers of sessions: of 64 sources that are gone a reader keeps some notes."""
MOST_BYTES = 750.0
"""Growth a session; a year has a thousand, and two per cent of a process are 0.7 MB [bytes]."""
SESSION = 30.0
"""Length of a session and of a segment [s]."""


class Site:
    """A rig that is switched on and off, its recorder and its witness."""

    def __init__(self, folder: Path) -> None:
        section = f'\n[recorder]\nfolder = "{folder}/sessions"\nsegment = {SESSION}\n'
        rig = TestRig(folder, section + "keep_gigabytes = 1e-4\n")
        network = MemoryNetwork()
        self.daq = network.bus("bench", "daq")
        self.monitor = Bus(MemoryTransport(network), "bench", "monitor", ring_bytes=1 << 10)
        self.ring = SampleRing(self.daq, 64)
        run = describe_run(rig.path, rig.config)
        self.recorder = Recorder(rig.config, run, network.bus("bench", "recorder"))
        self.witness = Witness(WitnessSection(), network.bus("bench", "witness"), 0.0)

    def session(self, number: int) -> None:
        """The device starts anew, has alarms, and stops."""
        now, begin_ns = number * SESSION, int(number * SESSION * 1e9)
        for seq in range(0, 64, 16):
            part = block(seq, 16, 1000 + number, begin_ns)
            self.ring.add(part)
            self.daq.publish(SAMPLES, part)
        self.monitor.publish(ALARMS, alarm(number))
        self.daq.publish(EVENTS, Event("daq", begin_ns, "info", "boot_changed", f"{number}"))
        self.daq.publish(HEALTH, Health("daq", begin_ns, "running", "", {"rate": number / 7.0}))
        for _ in range(2):
            now += 1.0
            self.recorder.turn(now, begin_ns)
            self.witness.turn(now, begin_ns)


def test_a_session_leaves_nothing_in_memory(tmp_path: Path) -> None:
    site = Site(tmp_path)
    tracemalloc.start()
    try:
        held = []
        for number in range(MANY):
            site.session(number)
            if number + 1 in (FEW, MANY):
                gc.collect()
                held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert (held[1] - held[0]) / (MANY - FEW) < MOST_BYTES
    assert site.recorder.feed.samples == 64 * MANY

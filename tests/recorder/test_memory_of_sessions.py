"""What a recorder and a witness hold stays the same over hundreds of sessions of a rig.

In a process of their own: what the threads of other tests allocate would count, too.
"""

import gc
import json
import subprocess
import sys
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
from tests.waiting import PATIENCE, eventually

FEW, MANY = 100, 130
"""Numbers of sessions: of 64 sources that are gone a reader keeps some notes."""
MOST_BYTES = 750.0
"""Growth a session; a year has a thousand, and two per cent of a process are 0.7 MB [bytes]."""
SESSION = 30.0
"""Length of a session and of a segment [s]."""
LENGTH = 64
"""The same in samples."""


class Site:
    """A rig that is switched on and off, its recorder and its witness."""

    def __init__(self, folder: Path) -> None:
        section = f'\n[recorder]\nfolder = "{folder}/sessions"\nsegment = {SESSION}\n'
        rig = TestRig(folder, section + "keep_gigabytes = 1e-4\n")
        network = MemoryNetwork()
        self.daq = network.bus("bench", "daq")
        self.monitor = Bus(MemoryTransport(network), "bench", "monitor", ring_bytes=1 << 10)
        self.ring = SampleRing(self.daq, LENGTH)
        run = describe_run(rig.path, rig.config)
        self.recorder = Recorder(rig.config, run, network.bus("bench", "recorder"))
        self.witness = Witness(WitnessSection(), network.bus("bench", "witness"), 0.0)

    def session(self, number: int) -> None:
        """The device starts anew, has alarms, and stops."""
        now, begin_ns = number * SESSION, int(number * SESSION * 1e9)
        for seq in range(0, LENGTH, 16):
            part = block(seq, 16, 1000 + number, begin_ns)
            self.ring.add(part)
            self.daq.publish(SAMPLES, part)
        self.monitor.publish(ALARMS, alarm(number))
        self.daq.publish(EVENTS, Event("daq", begin_ns, "info", "boot_changed", f"{number}"))
        self.daq.publish(HEALTH, Health("daq", begin_ns, "running", "", {"rate": number / 7.0}))
        recorded = (number + 1) * LENGTH
        for _ in range(2):
            now += 1.0
            self.turn(now, begin_ns)
        # What is fetched from the ring comes by a thread.
        eventually(lambda: self.turn(now, begin_ns) >= recorded, f"session {number}")

    def turn(self, now: float, t_ns: int) -> int:
        """One turn of both; the samples recorded so far."""
        self.recorder.turn(now, t_ns)
        self.witness.turn(now, t_ns)
        return self.recorder.feed.samples


def held(folder: Path) -> list[int]:
    """What they hold after `FEW` and after `MANY` sessions [bytes]."""
    site, found = Site(folder), []
    tracemalloc.start()
    for number in range(MANY):
        site.session(number)
        if number + 1 in (FEW, MANY):
            gc.collect()
            found.append(tracemalloc.get_traced_memory()[0])
    return found


def test_a_session_leaves_nothing_in_memory(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", __name__, str(tmp_path)],
        capture_output=True, text=True, timeout=2 * PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    few, many = json.loads(done.stdout)
    assert few > 0
    assert (many - few) / (MANY - FEW) < MOST_BYTES


if __name__ == "__main__":
    print(json.dumps(held(Path(sys.argv[1]))))

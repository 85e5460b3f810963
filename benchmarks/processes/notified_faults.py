"""From a fault in the samples to its notification, over a real router, monitor and witness.

    samples ─▶ router ─▶ monitor ─▶ alarm ─▶ router ─▶ witness ─▶ Apprise ─▶ HTTP ─▶ webhook

Every rig has a few faults at random times, one for each alarm: after the tenth in ten minutes
alarms are grouped, and one that returns is not announced again.
"""

import random
import threading
import time
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from monitor.alarms import read_journal
from rigwatch.wire.bus import Bus
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.messages import ESTIMATES, HEALTH, NON_FINITE, SAMPLES, SATURATED, SampleBlock
from tests.bus.publisher import wave
from tests.bus.rig import TestRig
from tests.monitor_process.model import monitor_section
from tests.waiting import eventually

RATE, BOOT, LENGTH = 256.0, 5, 8
"""Samples a second, boot of the source, and samples that a fault lasts."""
FAULTS = (("sensor_non_finite", NON_FINITE), ("sensor_saturated", SATURATED))
CHANNELS = ("voltage", "position", "acceleration")


@dataclass
class Source:
    """Publishes a sample every 1/256 s, faulty ones on request, and notes when each was sent."""

    bus: Bus
    sent: list[float] = field(default_factory=list)
    faulty: dict[int, tuple[str, int]] = field(default_factory=dict)

    def serve(self, stop: threading.Event) -> None:
        """Publish until `stop` is set."""
        ring, began, began_ns = SampleRing(self.bus, 65536), time.monotonic(), time.time_ns()
        while not stop.wait(max(0.0, began + len(self.sent) / RATE - time.monotonic())):
            seq = len(self.sent)
            block = self._with_fault(wave(seq, 1, BOOT, began_ns))
            self.sent.append(time.monotonic())
            ring.add(block)
            self.bus.publish(SAMPLES, block)

    def inject(self, channel: str, flag: int) -> None:
        """Give the next samples of a channel a flag of quality, as the adapter does."""
        first = len(self.sent) + 1
        self.faulty.update({first + n: (channel, flag) for n in range(LENGTH)})

    def _with_fault(self, block: SampleBlock) -> SampleBlock:
        name, flag = self.faulty.pop(block.seq, ("", 0))
        quality = np.full(len(block), flag, np.uint8)
        channels = (replace(c, quality=quality) if c.name == name else c for c in block.channels)
        return replace(block, channels=tuple(channels))


def delays(rigs: int, people: str, got: dict[str, float]) -> np.ndarray:
    """Delays of the alarms of so many rigs [s], from sending the sample that raises each.

    Args:
        rigs: how many, one after the other.
        people: text of the file of people.
        got: when each alarm came to the webhook [s], by name; filled meanwhile.
    """
    chance, found = random.Random(1), list[float]()
    for _ in range(rigs):
        with TemporaryDirectory() as folder:
            got.clear()
            found += _of_one(Path(folder), people, got, chance)
    return np.array(found)


def _of_one(folder: Path, people: str, got: dict[str, float], chance: random.Random) -> list[float]:
    (folder / "people.toml").write_text(people)
    witness = f'\n[witness]\npeople = "{folder}/people.toml"\n'
    with TestRig(folder, monitor_section(folder) + witness) as rig:
        rig.router()
        for process in ("monitor", "witness"):
            rig.start("-m", "rigwatch", process, str(rig.path))
        source, stop = Source(rig.bus("daq")), threading.Event()
        # The monitor reports once samples come; the witness's first report says that it listens.
        healths = source.bus.subscribe(HEALTH)
        eventually(lambda: "alive/monitor" in source.bus.tokens("alive/*"), "the monitor")
        eventually(lambda: any(one.source == "witness" for one in healths.drain()), "the witness")
        estimates = rig.bus("observer").subscribe_lossy(ESTIMATES)
        thread = threading.Thread(target=source.serve, args=(stop,), daemon=True)
        thread.start()
        eventually(lambda: bool(estimates.drain()), "estimates")
        names = []
        for (kind, flag), channel in product(FAULTS, CHANNELS):
            time.sleep(chance.uniform(0.3, 0.8))
            source.inject(channel, flag)
            names.append(f"{kind}.{channel}")
        eventually(lambda: set(names) <= set(got), "all notifications")
        stop.set()
        thread.join()
        records, _ = read_journal(folder / "alarms.jsonl")
    raised = {one.alarm.name: one.alarm.seq for one in reversed(records) if one.active}
    return [got[name] - source.sent[raised[name]] for name in names]

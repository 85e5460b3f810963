"""Many serial devices in one process: every line gets the same simulated healthy run at 256 Hz.

`python -m benchmarks.processes.many_devices TIMES LINE…` writes into the file TIMES when it sent
each sample [s on the monotonic clock].
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.archives.recordings import RATE, SCENARIO
from rigwatch.wire.device import encode
from rigwatch.wire.host import ROUTER, raise_priority
from sim_plant.scenario import ScenarioRun, load_scenario
from sim_plant.serve import Device, PtyLine
from sim_plant.serve.serial_server import frames

LONGEST = 3600
"""Longest run [s]."""


def sent_times(path: Path, mode: str = "r") -> NDArray[np.float64]:
    """When each sample was sent [s], by its number; 0 for those that were not yet."""
    shape = (LONGEST * RATE,)
    return np.memmap(path, np.float64, mode, shape=shape)  # type: ignore[call-overload,no-any-return]


def serve(times: Path, links: list[Path]) -> None:
    """Send until it is killed, before all else on the machine: no real device waits for it."""
    raise_priority(ROUTER + 1)
    sent = sent_times(times, "w+")
    lines = [PtyLine(link) for link in links]
    for line in lines:
        line.plug()
    began = time.monotonic()
    for number, frame in enumerate(encoded()):
        time.sleep(max(0.0, began + number / RATE - time.monotonic()))
        sent[number] = time.monotonic()
        for line in lines:
            line.write(frame)


def encoded() -> Iterator[bytes]:
    """The frames of a run, one after the other."""
    device = Device(ScenarioRun(load_scenario(SCENARIO), 1))
    for _ in range(LONGEST):
        yield from map(encode, frames(device.advance(RATE)))


if __name__ == "__main__":
    serve(Path(sys.argv[1]), [Path(link) for link in sys.argv[2:]])

"""What a block of nine samples costs in a daq and in a monitor of several rigs, without the bus.

    lines in memory ─▶ daq's chains ─▶ joined blocks ─▶ the monitor's seats ─▶ joined estimates

One process, a bus in memory, cycles in real time: what the code takes in a process that wakes for a
moment, without Zenoh and other processes (`many_rigs_chain`). Of many cycles the tenth that other
work disturbed least counts.
"""

import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.archives.recordings import MODEL, RATE
from benchmarks.processes.many_devices import encoded
from benchmarks.processes.many_rigs_chain import rig_files
from daq.__main__ import Chain
from daq.adapters.serial_line import SerialAdapter
from monitor.model import load_model
from monitor.pipeline import compile_together
from monitor.process.several import Seat, one_turn
from monitor.process.table import Tables, compile_table
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.host import Heartbeat
from rigwatch.wire.messages import ESTIMATES
from rigwatch.wire.rig_config import load_rig
from tests.many_rigs.rows.memory_links import MemoryLinks
from tests.waiting import eventually
from tools.benchmark_table import Row

RIGS, BLOCK = (16, 48), 9
"""Rigs of a process, and samples that each has in a cycle."""
WARM_UP = 300
"""Cycles that are not counted: clocks find their line, and references their period."""
LEAST = 10
"""Share of the cycles, the fastest ones, whose slowest counts [%]."""


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    return [row for rigs in RIGS for row in rows_of(rigs, 300 if quick else 1500)]


def rows_of(rigs: int, cycles: int) -> list[Row]:
    """The rows of so many rigs."""
    with TemporaryDirectory(prefix="rigwatch-blocks-") as name:
        daq, monitor = measured(rig_files(Path(name), rigs), cycles)
    what = f"a block of {BLOCK} samples, {rigs} rigs in one process, bus in memory"
    return [
        Row(f"{what}: daq", f"{daq:.0f} µs", "", "", "from the line's bytes to the message", None),
        Row(f"{what}: monitor", f"{monitor:.0f} µs", "", "", "from message to message", None),
    ]


def measured(paths: list[Path], cycles: int) -> tuple[float, float]:
    """Processor time of a block in daq and in the monitor [µs]."""
    network = MemoryNetwork()
    of_daq, links, of_listener = (MemoryLinks(network) for _ in range(3))
    model = load_model(MODEL)
    compile_together(model)
    compile_table(model)
    lines = [Line() for _ in paths]
    chains = [_chain(path, line, of_daq) for path, line in zip(paths, lines, strict=True)]
    heard = [of_listener.bus(path.stem, "listener").subscribe(ESTIMATES) for path in paths]
    seats = [
        Seat(path, print, lambda config, process: links.bus(config.rig.id, process))
        for path in paths
    ]
    tables = Tables(len(seats))

    def turn() -> None:
        one_turn(seats, links.together, links.collect, tables)

    def all_run() -> bool:
        turn()
        return all(seat.is_running for seat in seats)

    def step() -> None:
        with of_daq.together():
            for chain in chains:
                chain.step(0.0)

    eventually(all_run, "all rigs")
    counted = 0
    spent: tuple[list[float], list[float]] = [], []
    began = time.monotonic()
    for number, data in enumerate(_readings(WARM_UP + cycles)):
        for line in lines:
            line.put(data)
        # In real time: the clocks of device and host are compared.
        time.sleep(max(0.0, began + number * BLOCK / RATE - time.monotonic()))
        spent[0].append(_processor_time(step))
        spent[1].append(_processor_time(turn))
        of_listener.collect()
        counted += sum(len(block) for one in heard for block in one.drain())
    assert counted >= len(paths) * cycles * BLOCK, "estimates did not arrive"
    for seat in seats:
        seat.close()
    daq, monitor = (float(np.percentile(one[WARM_UP:], LEAST)) for one in spent)
    return 1e6 * daq / len(paths), 1e6 * monitor / len(paths)


class Line:
    """A serial line in memory."""

    def __init__(self) -> None:
        self._waiting = b""

    def open(self) -> None:
        """It is open."""

    def put(self, data: bytes) -> None:
        """Send from the other end."""
        self._waiting += data

    def read(self, _: float) -> bytes:
        """What has come."""
        data, self._waiting = self._waiting, b""
        return data

    def close(self) -> None:
        """Nothing to close."""


def _chain(path: Path, line: Line, links: MemoryLinks) -> Chain:
    config = load_rig(path)
    adapter = SerialAdapter(line, len(config.channels))
    chain = Chain(config, adapter, links.bus(config.rig.id, "daq"), Heartbeat("daq"))
    chain.device.start()
    return chain


def _readings(count: int) -> Iterator[bytes]:
    """What a line brings in each cycle."""
    frames = encoded()
    for _ in range(count):
        yield b"".join(islice(frames, BLOCK))


def _processor_time(call: Callable[[], object]) -> float:
    began = time.thread_time()
    call()
    return time.thread_time() - began

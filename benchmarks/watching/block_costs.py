"""What a block of nine samples costs in daq, monitor and recorder of several rigs, without the bus.

    lines in memory ─▶ daq's chains ─▶ joined blocks ─▶ the monitor's seats ─▶ joined estimates
                                            └───────────────┴─▶ recorders ─▶ sessions on disk

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
from daq.adapters.serial_line import SerialAdapter
from daq.chain import Chain
from daq.together import Lane
from monitor.model import load_model
from monitor.pipeline import compile_together
from monitor.process.several import Seat, one_turn
from monitor.process.table import Tables, compile_table
from rigwatch.recorder.process import Recorder, describe_run
from rigwatch.wire.bus import Subscription
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.host import Heartbeat
from rigwatch.wire.messages import ESTIMATES
from rigwatch.wire.quick_joining import join_quickly
from rigwatch.wire.rig_config import load_rig
from tests.many_rigs.rows.memory_links import MemoryLinks
from tests.waiting import eventually
from tools.benchmark_table import Row

RIGS, BLOCK = (16, 48), 9
"""Rigs of a process, and samples that each has in a cycle."""
TURN = 11
"""Cycles from one turn of the recorders to the next: 0.4 s."""
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
        daq, monitor, recorder = measured(rig_files(Path(name), rigs), cycles)
    what = f"a block of {BLOCK} samples, {rigs} rigs in one process, bus in memory"
    return [
        Row(f"{what}: daq", f"{daq:.0f} µs", "", "", "from the line's bytes to the message", None),
        Row(f"{what}: monitor", f"{monitor:.0f} µs", "", "", "from message to message", None),
        Row(
            f"{what}: recorder",
            f"{recorder:.0f} µs",
            "",
            "",
            f"from messages to the disk, {TURN} blocks and their estimates at a time",
            None,
        ),
    ]


def measured(paths: list[Path], cycles: int) -> tuple[float, float, float]:
    """Processor time of a block in daq, in the monitor and in the recorder [µs]."""
    rigs = Rigs(paths)
    spent: tuple[list[float], list[float], list[float]] = [], [], []
    began = time.monotonic()
    for number, data in enumerate(_readings(WARM_UP + cycles)):
        rigs.put(data)
        # In real time: the clocks of device and host are compared.
        time.sleep(max(0.0, began + number * BLOCK / RATE - time.monotonic()))
        spent[0].append(_processor_time(rigs.acquire))
        spent[1].append(_processor_time(rigs.judge))
        if number % TURN == 0:
            spent[2].append(_processor_time(rigs.record) / TURN)
        rigs.hear()
    rigs.close(cycles)
    settled = (one[len(one) * WARM_UP // (WARM_UP + cycles) :] for one in spent)
    daq, monitor, recorder = (1e6 * float(np.percentile(one, LEAST)) for one in settled)
    return daq / len(paths), monitor / len(paths), recorder / len(paths)


class Rigs:
    """Daq, monitor and recorder of several rigs, each as its process has them."""

    def __init__(self, paths: list[Path]) -> None:
        network, model = MemoryNetwork(), load_model(MODEL)
        self._daq, self._monitor, self._recorder, self._listener = (
            MemoryLinks(network) for _ in range(4)
        )
        compile_together(model)
        compile_table(model)
        join_quickly()
        self._lane, self._lines = Lane(), [Line() for _ in paths]
        self._chains = [
            _chain(path, line, self._daq) for path, line in zip(paths, self._lines, strict=True)
        ]
        self._heard, self._samples = [self._estimates(path) for path in paths], 0
        self._seats = [
            Seat(path, print, lambda config, process: self._monitor.bus(config.rig.id, process))
            for path in paths
        ]
        self._tables = Tables(len(paths))
        eventually(self._all_run, "all rigs")
        self._recorders = [_recorder(path, self._recorder) for path in paths]

    def _estimates(self, path: Path) -> Subscription:
        return self._listener.bus(path.stem, "listener").subscribe(ESTIMATES)

    def _all_run(self) -> bool:
        self.judge()
        return all(seat.is_running for seat in self._seats)

    def put(self, data: bytes) -> None:
        """What each line brings."""
        for line in self._lines:
            line.put(data)

    def acquire(self) -> None:
        """A cycle of daq."""
        with self._daq.together():
            self._lane.take(self._chains)
            for chain in self._chains:
                chain.step(0.0)

    def judge(self) -> None:
        """A turn of the monitor."""
        one_turn(self._seats, self._monitor.together, self._monitor.collect, self._tables)

    def record(self) -> None:
        """A turn of the recorders."""
        self._recorder.collect()
        for recorder in self._recorders:
            recorder.turn(time.monotonic(), time.time_ns())

    def hear(self) -> None:
        """Count the samples whose estimates have come."""
        self._listener.collect()
        self._samples += sum(len(block) for one in self._heard for block in one.drain())

    def close(self, cycles: int) -> None:
        """End, once so many cycles have been judged and recorded."""
        count = len(self._seats)
        assert self._samples >= count * cycles * BLOCK, "estimates did not arrive"
        for seat in self._seats:
            seat.close()
        for recorder in self._recorders:
            assert recorder.store.samples >= (cycles - TURN) * BLOCK, "samples were not recorded"
            recorder.close(time.monotonic(), time.time_ns())


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


def _recorder(path: Path, links: MemoryLinks) -> Recorder:
    config = load_rig(path)
    bus = links.bus(config.rig.id, "recorder")
    return Recorder(config, describe_run(path, config), bus)


def _readings(count: int) -> Iterator[bytes]:
    """What a line brings in each cycle."""
    frames = encoded()
    for _ in range(count):
        yield b"".join(islice(frames, BLOCK))


def _processor_time(call: Callable[[], object]) -> float:
    began = time.thread_time()
    call()
    return time.thread_time() - began

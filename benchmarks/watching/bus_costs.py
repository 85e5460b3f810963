"""What a block of nine samples costs on the bus, between processes of several rigs.

    sender (all rigs) ─▶ router ─┬─▶ reader (all rigs)
                                 └─▶ reader (all rigs)

Blocks are made once a turn and encoded, decoded and ordered, as between daq, monitor and recorder;
nothing else is done with them. Times are of the processor, read from the processes.
"""

import itertools
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from benchmarks.archives.recordings import ROOT
from benchmarks.processes.many_rigs_chain import rig_files
from daq.several import TURN
from rigwatch.wire.bus import Bus, SharedLinks, connect
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.host import Turns
from rigwatch.wire.messages import SAMPLES
from rigwatch.wire.rig_config import load_rig
from tests.bus.rig import answers, kill
from tests.bus.samples import block
from tests.waiting import eventually
from tools.benchmark_table import Row

RIGS, BLOCK = 40, 9
"""Rigs of each process, and samples that each has in a turn."""
SETTLE = 4.0
"""Time that is not counted [s]."""
LOOK_EVERY, TELL_EVERY = 0.005, 1.0
"""Time from one look of a reader to the next, as in a monitor, and from one report to the next [s].
"""


def run(quick: bool) -> list[Row]:
    """The row of this benchmark."""
    seconds = 8.0 if quick else 60.0
    with TemporaryDirectory(prefix="rigwatch-bus-") as name:
        spent, blocks, lost = measured(rig_files(Path(name), RIGS), seconds)
    each = ", ".join(f"{who} {1e6 * took / blocks:.0f}" for who, took in spent.items())
    return [
        Row(
            f"a block of {BLOCK} samples on the bus, {RIGS} rigs in each process",
            f"{1e6 * sum(spent.values()) / blocks:.0f} µs",
            "",
            "",
            f"µs: {each}; {blocks / seconds / RIGS:.0f} blocks a second and rig, {lost} samples "
            f"lost; load {psutil.getloadavg()[0]:.0f} on {psutil.cpu_count()} cores",
            None,
        )
    ]


def measured(paths: list[Path], seconds: float) -> tuple[dict[str, float], float, int]:
    """Processor time by process [s], the blocks that a reader has had meanwhile, lost samples."""
    with started(paths) as processes:
        reader = processes["reader"]
        first, _ = _told(reader, SETTLE)
        before = _cpu(processes)
        delivered, lost = _told(reader, seconds)
        spent = {name: took - before[name] for name, took in _cpu(processes).items()}
    return spent, (delivered - first) / BLOCK, lost


def _told(reader: "subprocess.Popen[str]", seconds: float) -> tuple[int, int]:
    """Samples delivered and lost, as a reader says after this time."""
    assert reader.stdout is not None
    until = time.monotonic() + seconds
    while True:
        delivered, lost = map(int, reader.stdout.readline().split())
        if time.monotonic() >= until:
            return delivered, lost


@contextmanager
def started(paths: list[Path]) -> "Iterator[dict[str, subprocess.Popen[str]]]":
    """Router, readers and sender as processes, by name."""
    made = {"router": _start("rigwatch", "router", str(paths[0]))}
    listen = load_rig(paths[0]).bus.listen
    try:
        eventually(lambda: answers(int(listen.rpartition(":")[2])), "the router listens")
        for name, role in (("reader", "monitor"), ("second reader", "recorder"), ("sender", "daq")):
            made[name] = _start("benchmarks.watching.bus_costs", role, *map(str, paths))
        yield made
    finally:
        for process in reversed(made.values()):
            kill(process)  # type: ignore[arg-type]


def _start(*words: str) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", *words]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)


def _cpu(processes: "dict[str, subprocess.Popen[str]]") -> dict[str, float]:
    times = {name: psutil.Process(one.pid).cpu_times() for name, one in processes.items()}
    return {name: found.user + found.system for name, found in times.items()}


def _steps(bus: Bus) -> Callable[[], bool]:
    """Sends the next block of a rig at each call."""
    numbers = itertools.count(0, BLOCK)

    def step() -> bool:
        bus.publish(SAMPLES, block(next(numbers), BLOCK))
        return True

    return step


def send(buses: list[Bus], links: SharedLinks) -> None:
    """Send blocks of all rigs in daq's turns, until killed."""
    turns = Turns(TURN, links.together)
    for bus in buses[1:]:
        threading.Thread(target=turns.serve, args=[_steps(bus)], daemon=True).start()
    turns.serve(_steps(buses[0]))


def hear(buses: list[Bus], links: SharedLinks) -> None:
    """Read the samples of all rigs as a monitor does, and tell how many, until killed."""
    readers, told = [SampleReader(bus) for bus in buses], time.monotonic()
    while True:
        began = time.monotonic()
        links.collect()
        for reader in readers:
            if reader.may_hold():
                reader.read(0.0)
        if began - told >= TELL_EVERY:
            told, counted = began, [reader.counters for reader in readers]
            print(sum(c.delivered for c in counted), sum(c.lost for c in counted), flush=True)
        time.sleep(max(0.0, began + LOOK_EVERY - time.monotonic()))


if __name__ == "__main__":
    role, *files = sys.argv[1:]
    own = SharedLinks(len(files))
    joined = [connect(load_rig(file), role, 60.0, own) for file in files]
    (send if role == "daq" else hear)(joined, own)

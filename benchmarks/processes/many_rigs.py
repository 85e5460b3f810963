"""Many rigs in one monitor: processor time and memory of a rig, latency, losses; real bus.

    source (all rigs) ─▶ router ─▶ monitor (all rigs) ─▶ router ─▶ subscriber (all rigs)

Every rig sends a simulated healthy run at 256 Hz, one sample a message. Times are of the processor,
read from the processes. `python -m benchmarks.processes.many_rigs RIGS… SECONDS` runs it with other
numbers.
"""

import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil

from benchmarks.archives.recordings import MODEL, RATE, ROOT, SCENARIO
from rigwatch.simulated import simulate
from rigwatch.wire.bus import connect
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.messages import ESTIMATES, SAMPLES, SampleBlock, pieces
from rigwatch.wire.rig_config import load_rig
from tests.bus.rig import answers, free_port, kill
from tests.waiting import eventually, wait_until
from tools.benchmark_table import Row, as_text

RING = 4096
SETTLE = 3.0
"""Time after the first estimates of all rigs that is not counted [s]."""


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    return [row(count, 10.0 if quick else 60.0) for count in ((1, 4) if quick else (1, 4, 16, 64))]


def row(count: int, seconds: float) -> Row:
    """The row of so many rigs."""
    with tempfile.TemporaryDirectory(prefix="rigwatch-rigs-") as name:
        found = measured(Path(name), count, seconds)
    core, memory, p50, p99, lost = found
    return Row(
        f"one monitor, {count} rig{'s' * (count > 1)} at {RATE} Hz",
        f"{core:.2f} % of a core a rig, {memory:.0f} MB in all",
        "p99 < 50 ms, nothing lost",
        "",
        f"sample sent to estimate received: p50 {p50:.0f}, p99 {p99:.0f} ms; {lost} without "
        f"an estimate; processor's time of the whole process, divided; {seconds:.0f} s, "
        f"load {psutil.getloadavg()[0]:.0f} on {psutil.cpu_count()} cores",
        p99 < 50.0 and lost == 0,
    )


def measured(folder: Path, count: int, seconds: float) -> tuple[float, float, float, float, int]:
    """Share of a core of a rig [%], memory of all [MB], latencies [ms], lost samples."""
    paths = rig_files(folder, count)
    with started(paths) as (monitor, source):
        buses = [connect(load_rig(path), "subscriber", 60.0) for path in paths]
        heard = [bus.subscribe(ESTIMATES) for bus in buses]
        latest = [-1] * count
        late: list[float] = []
        missing = 0

        def take(*, counted: bool) -> None:
            nonlocal missing
            for number, one in enumerate(heard):
                for block in one.drain():
                    if counted:
                        missing += block.seq - latest[number] - 1
                        late.append((time.time_ns() - int(block.t_ns[0])) / 1e6)
                    latest[number] = block.seq + len(block) - 1

        def all_there() -> bool:
            take(counted=False)
            return min(latest) >= 0

        assert wait_until(all_there, 120.0, 0.05), "not all rigs were judged"
        repeat_for(SETTLE, lambda: take(counted=False))
        before, began = _cpu(monitor), time.monotonic()
        repeat_for(seconds, lambda: take(counted=True))
        share = 100 * (_cpu(monitor) - before) / (time.monotonic() - began) / count
        memory = psutil.Process(monitor.pid).memory_info().rss / 1e6
        assert source.poll() is None
        for bus in buses:
            bus.close()
    p50, p99 = np.percentile(late, [50, 99])
    return share, memory, float(p50), float(p99), missing


def repeat_for(seconds: float, call: Callable[[], object]) -> None:
    """Call every few milliseconds."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        call()
        time.sleep(0.004)


def _cpu(process: "subprocess.Popen[bytes]") -> float:
    times = psutil.Process(process.pid).cpu_times()
    return times.user + times.system


def rig_files(folder: Path, count: int) -> list[Path]:
    """Configurations of rigs on one router, with the demonstration's channels."""
    port = free_port()
    text = (ROOT / "configs" / "demo.toml").read_text()
    text = re.sub(r"127\.0\.0\.1:\d+", f"127.0.0.1:{port}", text)
    text = text.replace("demo-session/model.toml", str(MODEL))
    paths = [folder / f"rig{number}.toml" for number in range(count)]
    for path in paths:
        own = text.replace('id = "demo"', f'id = "{path.stem}"')
        path.write_text(own.replace("demo-session/alarms", str(folder / path.stem)))
    return paths


@contextmanager
def started(
    paths: list[Path],
) -> "Iterator[tuple[subprocess.Popen[bytes], subprocess.Popen[bytes]]]":
    """Router, monitor and source as processes; the last two."""
    words = [str(path) for path in paths]
    made = [_start("-m", "rigwatch", "router", words[0])]
    address = load_rig(paths[0]).bus.listen
    try:
        eventually(lambda: answers(int(address.rpartition(":")[2])), "the router listens")
        made.append(_start("-m", "rigwatch", "monitor", *words))
        bus = connect(load_rig(paths[-1]), "looker", 60.0)
        eventually(lambda: "alive/monitor" in bus.tokens("alive/*"), "the monitor")
        bus.close()
        made.append(_start("-m", "benchmarks.processes.many_rigs", "source", *words))
        yield made[1], made[2]
    finally:
        for process in reversed(made):
            kill(process)


def _start(*arguments: str) -> "subprocess.Popen[bytes]":
    return subprocess.Popen([sys.executable, *arguments], cwd=ROOT, stdout=subprocess.DEVNULL)


def source(paths: list[Path]) -> None:
    """Sends samples of all rigs in turn until it is killed."""
    buses = [connect(load_rig(path), "daq", 60.0) for path in paths]
    rings = [SampleRing(bus, RING) for bus in buses]
    began, began_ns = time.monotonic(), time.time_ns()
    for number, block in enumerate(_samples()):
        t_ns = began_ns + block.seq * 10**9 // RATE
        now = SampleBlock(
            "rig", 1, block.seq, block.device_us, np.array([t_ns], np.int64), block.channels
        )
        time.sleep(max(0.0, began + number / RATE - time.monotonic()))
        for bus, ring in zip(buses, rings, strict=True):
            ring.add(now)
            bus.publish(SAMPLES, now)


def _samples() -> Iterator[SampleBlock]:
    for whole in simulate(SCENARIO, seconds=3600.0, block=256):
        yield from pieces(whole, 1)


if __name__ == "__main__":
    if sys.argv[1] == "source":
        source([Path(path) for path in sys.argv[2:]])
    else:
        *counts, seconds = sys.argv[1:]
        print(as_text([row(int(count), float(seconds)) for count in counts]))

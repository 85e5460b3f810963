"""Many rigs, the whole chain: processor time and memory of daq, monitor and recorder, latency.

    devices (serial lines) ─▶ daq ─▶ router ─▶ monitor ─▶ router ─▶ subscriber
                                       └─────────┴─▶ recorder ─▶ sessions

The subscriber is one process for up to forty of the rigs; that nothing is lost is read out of the
recordings of all.
`rigwatch up` of overlays over one base runs one process each for all rigs. Times are of the
processor, read from the processes. `python -m benchmarks.processes.many_rigs_chain RIGS… SECONDS`
runs it with other numbers.
"""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil

from benchmarks.archives.recordings import MODEL, RATE, ROOT
from benchmarks.processes.many_devices import sent_times
from benchmarks.processes.many_rigs import repeat_for
from rigwatch.wire.bus import Bus, SharedLinks, connect
from rigwatch.wire.host import MONITOR
from rigwatch.wire.messages import ESTIMATES
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from tests.bus.rig import free_port
from tests.waiting import eventually, wait_until
from tools.benchmark_table import Row, as_text

SETTLE = 5.0
"""Time after the first estimates of all rigs that is not counted [s]."""
CHAIN = ("daq", "monitor", "recorder")
MOST_HEARD = 40
"""Rigs whose estimates are timed: to hear more takes time from what is measured."""
BEGIN = 120.0
"""Longest wait for the first estimates and the recordings of all rigs [s]."""


@dataclass(frozen=True, slots=True)
class Found:
    """What was measured of so many rigs.

    Attributes:
        core: share of a core of a rig, by process [%].
        memory: of each process [MB].
        p50: median time from a sample's sending to the receipt of its estimate [ms].
        p99: the same, of 99 % of the samples [ms].
        missing: samples without an estimate, of the rigs that are heard.
        unrecorded: samples and estimates between the first and the last of a recording that are not
            in it, of all rigs.
    """

    core: dict[str, float]
    memory: dict[str, float]
    p50: float
    p99: float
    missing: int
    unrecorded: int


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    return [row(count, 10.0 if quick else 60.0) for count in ((1, 4) if quick else (1, 4, 8, 16))]


def row(count: int, seconds: float) -> Row:
    """The row of so many rigs."""
    with tempfile.TemporaryDirectory(prefix="rigwatch-chain-") as name:
        found = measured(Path(name), count, seconds)
    cores = ", ".join(f"{name} {found.core[name]:.2f}" for name in (*CHAIN, "router"))
    memory = ", ".join(f"{name} {found.memory[name]:.0f}" for name in (*CHAIN, "router"))
    return Row(
        f"daq, monitor and recorder of {count} rig{'s' * (count > 1)} at {RATE} Hz",
        f"{sum(found.core[name] for name in CHAIN):.1f} % of a core a rig, p99 {found.p99:.0f} ms",
        "p99 < 50 ms, nothing lost",
        "",
        f"% of a core a rig: {cores}; MB: {memory}; p50 {found.p50:.0f} ms; "
        f"{found.missing} samples without an estimate, {found.unrecorded} samples or estimates not "
        f"recorded; "
        f"{seconds:.0f} s, "
        f"load {psutil.getloadavg()[0]:.0f} on {psutil.cpu_count()} cores",
        found.p99 < 50.0 and found.missing == found.unrecorded == 0,
    )


def measured(folder: Path, count: int, seconds: float) -> Found:
    """Run the chain and measure it."""
    paths = rig_files(folder, count)
    with started(folder, paths) as processes:
        links = SharedLinks(count)
        heard_of = paths[:: -(-count // MOST_HEARD)]
        buses = [connect(load_rig(path), "subscriber", 60.0, links) for path in heard_of]
        heard = Estimates(buses, folder / "sent")
        assert wait_until(heard.all_there, BEGIN, 0.05), "not all rigs were judged"

        def recorded() -> bool:
            heard.take()
            return len(list((folder / "sessions").glob("*/*.mcap"))) >= count

        assert wait_until(recorded, BEGIN, 0.5), "not all recordings have begun"
        hear_at_once()
        repeat_for(SETTLE, heard.take)
        heard.forget()
        before, began = _cpu(processes), time.monotonic()
        repeat_for(seconds, heard.take)
        took = time.monotonic() - began
        used = {name: spent - before[name] for name, spent in _cpu(processes).items()}
        memory = {name: one.memory_info().rss / 1e6 for name, one in processes.items()}
        for bus in buses:
            bus.close()
        links.close()
    late = np.concatenate(heard.late)
    p50, p99 = np.percentile(1e3 * late, [50, 99])
    core = {name: 100 * spent / took / count for name, spent in used.items()}
    return Found(core, memory, float(p50), float(p99), heard.missing, _unrecorded(folder, paths))


class Estimates:
    """Estimates of all rigs, and when they came."""

    def __init__(self, buses: Sequence[Bus], times: Path) -> None:
        self._heard = [bus.subscribe(ESTIMATES) for bus in buses]
        self._latest = [-1] * len(buses)
        self._sent = sent_times(times)
        self.forget()

    def forget(self) -> None:
        """Count from now on."""
        self.late: list[np.ndarray] = []
        self.missing = 0

    def take(self) -> None:
        """Take what has come."""
        for number, one in enumerate(self._heard):
            for block in one.drain():
                last = block.seq + len(block) - 1
                self.missing += block.seq - self._latest[number] - 1
                self.late.append(time.monotonic() - self._sent[block.seq : last + 1])
                self._latest[number] = last

    def all_there(self) -> bool:
        """Whether every rig has been judged."""
        self.take()
        return min(self._latest) >= 0


def hear_at_once() -> None:
    """Let no thread of this process wait for the processor: its delay would be taken for theirs."""
    for thread in Path("/proc/self/task").iterdir():
        with suppress(OSError):
            os.sched_setscheduler(int(thread.name), os.SCHED_RR, os.sched_param(MONITOR))


def _cpu(processes: dict[str, psutil.Process]) -> dict[str, float]:
    times = {name: one.cpu_times() for name, one in processes.items()}
    return {name: found.user + found.system for name, found in times.items()}


def _unrecorded(folder: Path, paths: Sequence[Path]) -> int:
    missing = 0
    for path in paths:
        (folder_of_rig,) = (folder / "sessions").glob(f"{path.stem}-*Z")
        session = open_session(folder_of_rig)
        for blocks in (list(session.samples()), list(session.estimates())):
            whole = blocks[-1].seq + len(blocks[-1]) - blocks[0].seq
            missing += whole - sum(map(len, blocks))
    return missing


def rig_files(folder: Path, count: int) -> list[Path]:
    """Overlays over one base, with the demonstration's channels."""
    port = free_port()
    text = (ROOT / "configs" / "demo.toml").read_text()
    text = re.sub(r"127\.0\.0\.1:\d+", f"127.0.0.1:{port}", text[: text.index("[dashboard]")])
    text = re.sub(r"\[plant\].*?\n\n", "", text, flags=re.DOTALL)
    text = text.replace("demo-session/model.toml", str(MODEL))
    (folder / "base.toml").write_text(text.replace("demo-session/sessions", f"{folder}/sessions"))
    paths = [folder / f"rig{number:03d}.toml" for number in range(count)]
    for path in paths:
        path.write_text(
            f'base = "base.toml"\n[rig]\nid = "{path.stem}"\n[daq.device]\n'
            f'port = "{line_of(path)}"\n[monitor]\njournal = "{path.with_suffix(".jsonl")}"\n'
        )
    return paths


def line_of(path: Path) -> Path:
    """The serial line of a rig."""
    return path.with_suffix(".line")


@contextmanager
def started(folder: Path, paths: list[Path]) -> Iterator[dict[str, psutil.Process]]:
    """Devices, and the processes of `rigwatch up` by name."""
    words = ["-m", "benchmarks.processes.many_devices", str(folder / "sent")]
    devices = subprocess.Popen([sys.executable, *words, *map(str, map(line_of, paths))], cwd=ROOT)
    eventually(lambda: all(line_of(path).exists() for path in paths), "the lines")
    up = subprocess.Popen(
        [sys.executable, "-m", "rigwatch", "up", "--json", *map(str, paths)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield _ready(up)
        up.send_signal(signal.SIGTERM)
        up.wait(timeout=60.0)
    finally:
        for process in (up, devices):
            process.kill()
            process.wait()


def _ready(up: "subprocess.Popen[str]") -> dict[str, psutil.Process]:
    """The processes once all are ready."""
    assert up.stdout is not None
    for line in up.stdout:
        event = json.loads(line)
        states = event.get("processes", {})
        if states and all(one["state"] == "running" for one in states.values()):
            threading.Thread(target=_told, args=[up.stdout], daemon=True).start()
            return {name: psutil.Process(one["pid"]) for name, one in states.items()}
    raise RuntimeError("rigwatch up has ended")


def _told(lines: Iterable[str]) -> None:
    """Keep the pipe empty, and pass on what happens to the processes."""
    for line in lines:
        if json.loads(line)["event"] in ("ill", "ended", "says", "restarting"):
            print(line, end="", file=sys.stderr)


if __name__ == "__main__":
    *counts, seconds = sys.argv[1:]
    for count in counts:
        print(as_text([row(int(count), float(seconds))]), flush=True)

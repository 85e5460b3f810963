"""Latency from the last byte of a frame on the serial line to its estimate in another process.

    device ─pty─▶ daq ─▶ router ─▶ monitor ─▶ router ─▶ subscriber

The device records the time before it writes a frame, the subscriber the time after it has decoded
the estimate, both on the clock shared by all processes of the machine. A bare loop that sleeps for
one sample period runs in parallel: its lateness is the machine's jitter, a lower limit for any
software.
"""

import signal
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from benchmarks.processes.live_rig import LiveRig, live_rig
from rigwatch.wire.host.ending import set_at_signal
from rigwatch.wire.host.realtime import MONITOR, prepare_for_real_time, raise_priority
from tools.benchmark_table import Row

if TYPE_CHECKING:
    from sim_plant.serve.serial_server import SerialServer

PERIOD_MS = 1000.0 / 256.0
TLS_BAR_MS = 5.0
WARM_UP = 2.0
"""Start-up time that is not counted [s]."""
ENDS_WITHIN = 30.0
"""Longest end of a process that writes its figures [s]."""


def run(quick: bool) -> list[Row]:
    """Latency and jitter over 20 s or two minutes, without keys and with mutual TLS."""
    found = []
    for tls in (False, True):
        with live_rig(tls=tls) as rig:
            measured = measure(rig, 20.0 if quick else 120.0)
        found.append(row(*measured, tls=tls))
    return found


def row(
    latency: NDArray[np.float64], jitter: NDArray[np.float64], lost: int, *, tls: bool = False
) -> Row:
    """The table's row of latencies and jitter, both in milliseconds."""
    bar = TLS_BAR_MS if tls else PERIOD_MS
    p99 = float(np.percentile(latency, 99))
    note = (
        f"{len(latency)} samples, {lost} without an estimate; worst {latency.max():.2f} ms. "
        f"A bare loop that sleeps 1/256 s woke late in the same run by {_figures(jitter)} "
        f"(worst {jitter.max():.2f} ms)."
    )
    what = "latency, frame complete on the serial line to estimate received"
    return Row(
        f"{what}, mutual TLS" if tls else what,
        _figures(latency),
        f"p99 < {bar:.1f} ms",
        "",
        note,
        passed=p99 < bar and lost == 0,
    )


def _figures(values: NDArray[np.float64]) -> str:
    p50, p99, p999 = np.percentile(values, [50, 99, 99.9])
    return f"p50 {p50:.2f}, p99 {p99:.2f}, p99.9 {p999:.2f} ms"


def measure(rig: LiveRig, seconds: float) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Latency of each sample [ms], lateness of the bare loop [ms], samples without estimate."""
    sent, got, late = (rig.folder / name for name in ("sent.npy", "got.npy", "late.npy"))
    rig.command("router")
    module = ("-m", "benchmarks.processes.latency")
    rig.command("daq")
    rig.command("monitor")
    rig.start(*module, "subscriber", str(rig.path), str(got))
    rig.wait_for("daq", "monitor", "subscriber")
    device = rig.start(*module, "device", str(rig.path), str(sent))
    jitter = rig.start(*module, "jitter", str(rig.path), str(late))
    time.sleep(seconds + WARM_UP)
    for process in (device, jitter):
        process.send_signal(signal.SIGTERM)
        process.wait(ENDS_WITHIN)
    time.sleep(0.5)
    rig.close()
    return matched(np.load(sent), np.load(got), np.load(late))


def matched(
    sent: NDArray[np.int64], got: NDArray[np.int64], late: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Latencies [ms] of the samples sent, from times by number; jitter [ms]; how many are missing.

    Args:
        sent: shape (n,), time at which frame k was written [ns].
        got: shape (m, 2), number of a sample and arrival time of its estimate [ns].
        late: shape (k,), lateness of the bare loop [ns].
    """
    received = np.full(len(sent), -1, np.int64)
    known = got[got[:, 0] < len(sent)]
    # Written backwards, so that the first of two equal estimates counts.
    received[known[::-1, 0]] = known[::-1, 1]
    counted = np.arange(int(WARM_UP * 256), len(sent))
    there = counted[received[counted] >= 0]
    latency = (received[there] - sent[there]) / 1e6
    return latency, late[int(WARM_UP * 256) :] / 1e6, len(counted) - len(there)


def device(config: Path, out: Path, stop: threading.Event) -> None:
    """The simulated rig on its serial line, recording the time of each frame."""
    from rigwatch.wire.rig_config import load_rig
    from sim_plant.scenario import ScenarioRun, load_scenario
    from sim_plant.serve.pty_line import PtyLine
    from sim_plant.serve.serial_server import SerialServer
    from sim_plant.serve.source import Device

    class NotingLine(PtyLine):
        """A line that records the times of writing."""

        times: list[int]

        def write(self, data: bytes) -> None:
            self.times.append(time.monotonic_ns())
            super().write(data)

    plant = load_rig(config).plant
    assert plant is not None
    line = NotingLine(plant.port)
    line.times = []
    run_of = ScenarioRun(load_scenario(plant.scenario), plant.seed)
    run_of.advance(1)
    simulated = Device(run_of)
    with line:
        while not line.heard() and not stop.is_set():
            time.sleep(0.01)
        _serve(SerialServer(simulated, line), stop)
    np.save(out, np.array(line.times, np.int64))


def _serve(server: "SerialServer", stop: threading.Event) -> None:
    from sim_plant.serve.source import Pace

    pace = Pace(256.0)
    while not stop.wait(pace.until_next()):
        server.step(pace.due())


def subscriber(config: Path, out: Path, stop: threading.Event) -> None:
    """Records the arrival time of each sample's estimate."""
    from rigwatch.wire.bus.connection import connect
    from rigwatch.wire.messages.topics import ESTIMATES
    from rigwatch.wire.rig_config import load_rig

    bus = connect(load_rig(config), "subscriber")
    estimates = bus.subscribe(ESTIMATES)
    got: list[tuple[int, int]] = []
    prepare_for_real_time()
    while not stop.is_set():
        if (block := estimates.get(timeout=0.1)) is not None:
            now = time.monotonic_ns()
            got += [(seq, now) for seq in range(block.seq, block.seq + len(block))]
    bus.close()
    np.save(out, np.array(got, np.int64).reshape(-1, 2))


def jitter(_config: Path, out: Path, stop: threading.Event) -> None:
    """Lateness of a loop that only sleeps for one sample period."""
    late: list[int] = []
    period = 1.0 / 256.0
    while not stop.is_set():
        before = time.monotonic_ns()
        time.sleep(period)
        late.append(time.monotonic_ns() - before - int(period * 1e9))
    np.save(out, np.array(late, np.int64))


ROLES = {"device": device, "subscriber": subscriber, "jitter": jitter}


def main(role: str, config: str, out: str) -> None:
    """One of the processes of the measurement."""
    stop = set_at_signal()
    raise_priority(MONITOR)
    ROLES[role](Path(config), Path(out), stop)


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Replay of recordings: how fast, with how much memory, and whether it gives the live numbers."""

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks.archives.recordings import MODEL, ROOT, SCENARIO
from monitor.model.model_file import load_model
from monitor.pipeline.rig_monitor import RigMonitor, compile_kernels
from rigwatch.replay.cases import load_cases, replayed
from rigwatch.replay.choice import monitor_for
from rigwatch.replay.reference import Output
from rigwatch.replay.run import replay
from rigwatch.simulated import simulate
from rigwatch.wire.messages.blocks import pieces
from rigwatch.wire.messages.message_types import SampleBlock
from rigwatch.wire.messages.protobuf import encode
from rigwatch.wire.session import SessionWriter, open_session, run_info
from tools.benchmark_table import Row

CASES = ROOT / "tests" / "verify" / "cases.toml"
FLUSH = 102
"""Samples in one flush of the recorder: 0.4 s."""
REPEATS = 3
LEAST_SPEED = 10_000.0
ROOM = 16.0
"""A longer recording may take this much more memory before it counts as growth [MiB]."""


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    seconds = 600.0 if quick else 3600.0
    with tempfile.TemporaryDirectory() as folder:
        short, long = Path(folder, "short.mcap"), Path(folder, "long.mcap")
        record(short, seconds / 4)
        record(long, seconds)
        return [speed(long, seconds), reading(long), memory(short, long), same_bits()]


def record(path: Path, seconds: float) -> None:
    """A session as the recorder leaves it: samples and estimates, a chunk every 0.4 s."""
    monitor = RigMonitor(load_model(MODEL))
    with SessionWriter(path, run_info("bench", 256.0), sync=False) as writer:
        for block in blocks_of(seconds):
            watched = monitor.update(block)
            writer.write(block)
            if watched is not None:
                writer.write(watched.estimates)
            writer.flush()


def blocks_of(seconds: float) -> Iterator[SampleBlock]:
    """A friction-free run in blocks as long as the recorder's."""
    for whole in simulate(SCENARIO, seconds=seconds):
        yield from pieces(whole, FLUSH)


def speed(path: Path, seconds: float) -> Row:
    """Times real time, the file read from disk, the best of a few runs.

    Judged by the processor's time, which is that of the clock on a machine with nothing else to do.
    """
    compile_kernels(load_model(MODEL))
    wall = processor = 0.0
    for _ in range(REPEATS):
        session = open_session(path)
        began = time.process_time()
        done = replay(session, monitor_for(session, MODEL, None))
        processor = max(processor, done.duration_s / (time.process_time() - began))
        wall = max(wall, done.times_real_time)
    return Row(
        "replay, reading the file included",
        f"{processor:,.0f} × real time",
        f"≥ {LEAST_SPEED:,.0f} ×",
        "",
        f"{seconds:.0f} s recorded with estimates in chunks of 0.4 s, best of {REPEATS} runs by "
        f"processor time; {wall:,.0f} × by the clock, beside everything else that ran",
        processor >= LEAST_SPEED,
    )


def reading(path: Path) -> Row:
    """Samples a second out of the file, all checksums checked."""
    best = 0.0
    for _ in range(REPEATS):
        began = time.perf_counter()
        count = sum(map(len, open_session(path).samples()))
        best = max(best, count / (time.perf_counter() - began))
    return Row("reading samples alone", f"{best / 1e6:.1f} million samples/s", "", "", "", None)


def memory(short: Path, long: Path) -> Row:
    """Largest memory of a replay, over a recording and over one four times as long."""
    peaks = [peak_of(path) for path in (short, long)]
    return Row(
        "memory of a replay, recording 4 times as long",
        f"{peaks[0]:.0f} → {peaks[1]:.0f} MiB",
        "flat",
        "",
        f"resident memory of the whole process; growth below {ROOM:.0f} MiB counts as flat",
        peaks[1] - peaks[0] < ROOM,
    )


def peak_of(path: Path) -> float:
    """Largest resident memory of a process that replays `path` [MiB]."""
    command = [sys.executable, "-m", "benchmarks.watching.replay", str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return float(json.loads(done.stdout)) / 1024


def same_bits() -> Row:
    """Blocks as they come live against whole recordings, every published field."""
    differing = []
    for case in load_cases(CASES):
        session = open_session(CASES.parent / case.recording)
        outputs = [replayed(case, CASES.parent, session, size) for size in (1 << 30, 1, 3, 8)]
        expected, *others = map(as_bytes, outputs)
        differing += [case.name for other in others if other != expected]
    return Row(
        "live (blocks of 1, 3, 8) against replay",
        f"differs in {', '.join(differing)}" if differing else "bit-identical",
        "bit-identical",
        "",
        "every estimate, condition and alarm of the recordings in tests/verify",
        not differing,
    )


def as_bytes(output: Output) -> list[bytes]:
    return [encode(item) for item in (*output.blocks, *output.announcements)]


if __name__ == "__main__":
    recording = open_session(sys.argv[1])
    replay(recording, monitor_for(recording, MODEL, None))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)

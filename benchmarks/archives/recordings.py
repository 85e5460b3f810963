"""Recordings for the benchmarks of archives: a simulated rig, cut into sessions."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from monitor.model.model_file import load_model
from monitor.pipeline.rig_monitor import RigMonitor
from rigwatch.simulated import EPOCH_NS, simulate
from rigwatch.wire.messages import SampleBlock, pieces
from rigwatch.wire.session import SessionWriter, run_info

ROOT = Path(__file__).parents[2]
SCENARIO = ROOT / "configs" / "scenarios" / "healthy_sine_8hz_1v4.toml"
MODEL = ROOT / "tests" / "verify" / "model.toml"
RATE = 256
FLUSH = RATE // 2
"""Samples in a chunk: half a second, as the recorder writes them."""
RIGS = 20


def make_recordings(
    folder: Path, count: int, seconds: int, *, estimates: bool = False
) -> list[Path]:
    """Sessions of one long run, one after the other, with the monitor's estimates if wanted."""
    folder.mkdir(parents=True)
    blocks = _blocks(count * seconds)
    monitor = RigMonitor(load_model(MODEL)) if estimates else None
    return [_session(folder, number, seconds, blocks, monitor) for number in range(count)]


def _session(
    folder: Path,
    number: int,
    seconds: int,
    blocks: Iterator[SampleBlock],
    monitor: RigMonitor | None,
) -> Path:
    path = folder / f"run{number:05d}.mcap"
    run = run_info(f"rig{number % RIGS}", RATE, t_ns=EPOCH_NS + number * seconds * 10**9)
    with SessionWriter(path, run, sync=False) as writer:
        for block in islice(blocks, seconds * RATE // FLUSH):
            writer.write(block)
            if monitor is not None and (watched := monitor.update(block)) is not None:
                writer.write(watched.estimates)
            writer.flush()
    return path


def _blocks(seconds: int) -> Iterator[SampleBlock]:
    for whole in simulate(SCENARIO, seconds=float(seconds), block=32 * FLUSH):
        yield from pieces(whole, FLUSH)

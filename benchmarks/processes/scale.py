"""What a sample, a recording and a query cost: processor time, bytes on the bus and on disk.

Times are of the processor, so that another load on the machine counts little. What a rig costs in a
process of several is measured by `many_rigs`.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec

from benchmarks.archives.recordings import MODEL, RATE, ROOT, SCENARIO, make_recordings
from monitor.model import load_model
from monitor.pipeline import RigMonitor, compile_kernels, judge_together, ready_of
from monitor.process.loop import MonitorProcess
from rigwatch.archive import Store, ask, index
from rigwatch.commands.sessions.replay import judged
from rigwatch.simulated import simulate
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.messages import SAMPLES, SampleBlock, encode, pieces
from rigwatch.wire.rig_config import RigConfig, load_rig
from tools.benchmark_table import Row

WARM_UP = 200
"""Samples that are not counted."""
BLOCKS = (1, 6, 24)
"""Samples that a monitor finds at once: as they come, in a turn of 25 ms, and of 100 ms."""
RIGS, BLOCK = 16, 9
"""Rigs that are judged together, and samples that one has in a turn."""
SECONDS = 60
"""Length of a recording [s]."""


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    samples = 4000 if quick else 20_000
    with TemporaryDirectory(prefix="rigwatch-scale-") as name:
        folder = Path(name)
        rows = [_judging(folder, size, samples) for size in BLOCKS]
        return [*rows, _together(samples), _bus(), *_recordings(folder, 10 if quick else 100)]


def _row(what: str, measured: str, note: str = "") -> Row:
    return Row(what, measured, "", "", note, None)


def _judging(folder: Path, size: int, samples: int) -> Row:
    """The monitor's whole loop over samples that come so many at a time."""
    place = folder / f"blocks{size}"
    place.mkdir()
    bench = _Bench(place)
    payloads = [encode(one) for one in _samples(samples + WARM_UP)]
    bench.turn(payloads[:WARM_UP])
    took = _processor_time(lambda: bench.turns(payloads[WARM_UP:], size))
    each = took / samples
    return _row(
        f"a sample in the monitor, {size} at a time",
        f"{each * 1e6:.0f} µs, {100 * RATE * each:.2f} % of a core at {RATE} Hz",
        "decoding, judging, alarms, supervision of the link, encoding; without the bus",
    )


def _together(samples: int) -> Row:
    """Blocks of nine samples judged by one call for several rigs, and by one for each."""
    model = load_model(MODEL)
    rigs = [RigMonitor(model) for _ in range(RIGS)]
    blocks = [
        one
        for whole in simulate(SCENARIO, seconds=samples / RATE, block=28 * BLOCK)
        for one in pieces(whole, BLOCK)
    ]

    def alone(some: list[SampleBlock]) -> None:
        for block in some:
            for rig in rigs:
                rig.update(block)

    def together(some: list[SampleBlock]) -> None:
        for block in some:
            ready = [ready_of(rig, block) for rig in rigs]
            found = judge_together([one for one in ready if one is not None])
            assert len(found) == RIGS
            for rig, finish in zip(rigs, found, strict=True):
                assert finish is not None
                rig.announce(*finish())

    third = len(blocks) // 3
    alone(blocks[:third])
    each = [
        1e6 * _processor_time(partial(call, some)) / len(some) / RIGS
        for call, some in ((alone, blocks[third : 2 * third]), (together, blocks[2 * third :]))
    ]
    return _row(
        f"a block of {BLOCK} samples judged, alone and with those of {RIGS} rigs",
        f"{each[0]:.0f} and {each[1]:.0f} µs",
        "admission to alarms, without decoding and encoding",
    )


@dataclass
class _Bench:
    """A monitor whose loop is turned by hand, on a bus in memory."""

    folder: Path

    def __post_init__(self) -> None:
        model = load_model(MODEL)
        compile_kernels(model)
        network = MemoryNetwork()
        self._daq = network.bus("demo", "daq")
        config = _config(self.folder)
        self._monitor = MonitorProcess(config, "demo", model, network.bus("demo", "monitor"))

    def turns(self, payloads: list[bytes], size: int) -> None:
        for some in (payloads[at : at + size] for at in range(0, len(payloads), size)):
            self.turn(some)

    def turn(self, payloads: list[bytes]) -> None:
        for payload in payloads:
            self._daq.transport.put(self._daq.key(SAMPLES.key), payload)
        for item in self._monitor.reader.read(0.0):
            self._monitor.take(item)
        self._monitor.keep_position()
        self._monitor.look_around()


def _config(folder: Path) -> RigConfig:
    config = load_rig(ROOT / "configs" / "demo.toml")
    assert config.monitor is not None
    own = msgspec.structs.replace(
        config.monitor, model=str(MODEL), journal=str(folder / "alarms.jsonl")
    )
    return msgspec.structs.replace(config, monitor=own)


def _samples(count: int) -> Iterator[SampleBlock]:
    for whole in simulate(SCENARIO, seconds=count / RATE, block=RATE):
        yield from pieces(whole, 1)


def _bus() -> Row:
    """Payloads of one sample and of its estimates."""
    monitor = RigMonitor(load_model(MODEL))
    block = next(_samples(RATE))
    watched = monitor.update(block)
    assert watched is not None
    sample, estimate = len(encode(block)), len(encode(watched.estimates))
    return _row(
        "a sample on the bus, one a message",
        f"{sample} bytes, its estimates {estimate}; {RATE * (sample + estimate) / 1e3:.0f} kB/s",
        "payloads without Zenoh's and TCP's headers; each subscriber receives them once more",
    )


def _recordings(folder: Path, count: int) -> Iterator[Row]:
    plain = make_recordings(folder / "plain", count, SECONDS)
    full = make_recordings(folder / "full", count, SECONDS, estimates=True)
    bare, whole = (sum(p.stat().st_size for p in files) / count for files in (plain, full))
    yield _row(
        "a sample on disk",
        f"{bare / SECONDS / RATE:.0f} bytes, with its estimates {whole / SECONDS / RATE:.0f}; "
        f"{whole / SECONDS * 86_400 / 1e9:.2f} GB a rig and day",
        f"compressed sessions of {SECONDS} s with three channels",
    )
    judged(plain[0], MODEL, None, None, None)
    took = _processor_time(lambda: [judged(path, MODEL, None, None, None) for path in plain])
    yield _row(
        f"replay of a recording of {SECONDS} s",
        f"{1e3 * took / count:.1f} ms, {count * SECONDS / took:,.0f} × real time on one core",
    )
    make_recordings(folder / "first", 1, SECONDS, estimates=True)
    index(Store(str(folder / "first")))  # loads what it needs
    ask(Store(str(folder / "first")), "losses")
    store = Store(str(folder / "full"))
    took = _processor_time(lambda: index(store))
    size = sum(p.stat().st_size for p in (folder / "full" / "rigwatch-index").rglob("*.parquet"))
    yield _row(
        f"index of a recording of {SECONDS} s with estimates",
        f"{1e3 * took / count:.1f} ms, {size / count / 1e3:.1f} kB",
    )
    took = _processor_time(lambda: ask(store, "losses"))
    yield _row("a question to the catalogue", f"{1e3 * took:.0f} ms", f"of {count} sessions")


def _processor_time(call: Callable[[], object]) -> float:
    began = time.process_time()
    call()
    return time.process_time() - began

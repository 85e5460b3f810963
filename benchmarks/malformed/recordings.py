"""An intact session, and readers of its mutations: all that reads a session reads each of them."""

import contextlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import zstandard

from benchmarks.malformed.records import chunk_of
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import (
    TOPICS,
    Alarm,
    Column,
    EstimateBlock,
    Event,
    Gap,
    Health,
    Message,
    SampleBlock,
)
from rigwatch.wire.session import (
    Place,
    SessionWriter,
    Wanted,
    open_session,
    read_page,
    recover,
    run_info,
    summarise,
    topic_counts,
)
from rigwatch.wire.session.chunks import MAGIC, Chunk, scan

SESSION_SAMPLES, BLOCK = 256, 32
BEGAN_NS, PERIOD_NS = 10**18, 3_906_250
PAGE, MOST_PAGES = 1 << 16, 100
Reader = Callable[[bytes], None]


def block_from(first: int) -> SampleBlock:
    """The samples from a number on."""
    index = np.arange(first, first + BLOCK)
    values = np.random.default_rng(first).normal(size=BLOCK)
    column = Column("voltage", "V", values, np.zeros(BLOCK, np.uint8))
    return SampleBlock("rig", 7, first, index * 3906, BEGAN_NS + index * PERIOD_NS, (column,))


def intact_session(folder: Path) -> bytes:
    """The bytes of a short session of samples."""
    return _written(folder / "intact.mcap", lambda block: [block])


def session_readers(folder: Path) -> dict[str, tuple[Reader, tuple[bytes, ...]]]:
    """Readers of mutated files and of mutated records under right checksums, with examples."""
    path = folder / "fuzzed.mcap"
    intact = _written(folder / "whole.mcap", _all_kinds)
    records = tuple(one.records for one in scan(folder / "whole.mcap") if isinstance(one, Chunk))

    def read_file(data: bytes) -> None:
        path.write_bytes(data)
        _read_all(path)

    def read_records(data: bytes) -> None:
        chunk = chunk_of(data, zstandard.compress(data), b"zstd")
        read_file(MAGIC + chunk + MAGIC)

    samples_alone = intact_session(folder)
    return {
        "sessions": (read_file, (intact, samples_alone, intact[: len(intact) * 2 // 3])),
        "sessions under right checksums": (read_records, records),
    }


def _written(path: Path, also: Callable[[SampleBlock], list[Message]]) -> bytes:
    with SessionWriter(path, run_info("bench", 256.0, t_ns=1), sync=False) as writer:
        for first in range(0, SESSION_SAMPLES, BLOCK):
            for message in also(block_from(first)):
                writer.write(message)
            writer.flush()
    return path.read_bytes()


def _all_kinds(block: SampleBlock) -> list[Message]:
    """A block, and what the other processes say of it."""
    at, nan = int(block.t_ns[0]), float("nan")
    alarm = Alarm(
        "departure", "unacknowledged", "error", "the rig departs", "look", "rig", 7, block.seq, at,
        1.5, nan, 1.0, False, "", block.seq,
    )  # fmt: skip
    return [
        block,
        EstimateBlock(block.device, block.boot, block.seq, block.t_ns, block.channels),
        alarm,
        Event("daq", at, "info", "STARTED", "begins"),
        Gap("rig", 7, block.seq, block.seq, at, "daq/rig", "lost"),
        Health("daq/rig", at, "running", "", {"rate_hz": 256.0}),
    ]


def _read_all(path: Path) -> None:
    """Everything that reads a session; a refusal by one keeps none of the others from reading."""
    readers: tuple[Callable[[], object], ...] = (
        lambda: _each_valid(path),
        lambda: list(open_session(path).estimates()),
        lambda: list(open_session(path).messages()),
        lambda: list(open_session(path).messages(["alarms"], BEGAN_NS, BEGAN_NS + 10**9)),
        lambda: summarise(open_session(path)),
        lambda: open_session(path).check_content(),
        lambda: _pages(path),
        lambda: _recovered(path),
        lambda: topic_counts(path),
    )
    for reader in readers:
        with contextlib.suppress(RigwatchError):
            reader()


def _each_valid(path: Path) -> None:
    for block in open_session(path).samples():
        assert len(block.t_ns) == len(block)


def _pages(path: Path) -> None:
    wanted = Wanted(frozenset(TOPICS), 0, 2 * BEGAN_NS, PAGE)
    place = Place()
    for _ in range(MOST_PAGES):
        _, following = read_page([path], wanted, place)
        if following is None:
            return
        place = following
    raise AssertionError("pages without end")


def _recovered(path: Path) -> None:
    target = path.with_name("recovered.mcap")
    target.unlink(missing_ok=True)
    recover(open_session(path), target)

"""What is written comes back bit for bit, in order, also from a file that was never closed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import encode
from rigwatch.wire.messages.message_types import (
    Alarm,
    AlarmCommand,
    Column,
    EstimateBlock,
    Event,
    Gap,
    Health,
    Message,
    SampleBlock,
)
from rigwatch.wire.session import SessionWriter, open_session, run_info

T0 = 1_700_000_000_000_000_000
STEP = 3_906_250


def samples(seq: int, n: int, boot: int = 7) -> SampleBlock:
    index = np.arange(seq, seq + n)
    quality = (index % 5 == 0).astype(np.uint8)
    holes = index.astype(np.float64)
    holes[index % 11 == 3] = np.nan
    channels = (
        Column("voltage", "V", np.asarray(np.sin(index / 9.0), np.float64), quality),
        Column("position", "m", holes, quality),
    )
    return SampleBlock("rig", boot, seq, index * 3906, T0 + index * STEP, channels)


def estimates(seq: int, n: int) -> EstimateBlock:
    index = np.arange(seq, seq + n)
    column = Column("theta1", "", index.astype(np.float64))
    return EstimateBlock("rig", 7, seq, T0 + index * STEP, (column,))


def same(first: SampleBlock | EstimateBlock, second: SampleBlock | EstimateBlock) -> bool:
    return encode(first) == encode(second)


ALARM = Alarm(
    "dry_friction", "unacknowledged", "warning", "friction", "stop", "rig", 7, 12, T0, 1.0,
    -np.inf, 2.0, True, "", 11,
)  # fmt: skip
OTHERS = (
    ALARM,
    AlarmCommand("*", "reset", "anna", T0 + 5, "seen"),
    Gap("rig", 7, 3, 9, T0 + 6, "recorder", "not in the ring"),
    Health("daq/rig", T0 + 7, "running", "", {"rate_hz": 256.0, "lost_samples": 0.0}),
    Event("daq/rig", T0 + 8, "info", "REPLUG", "the line came back"),
)


def test_every_kind_of_message_comes_back(tmp_path: Path) -> None:
    run = run_info("bench1", 256.0, t_ns=T0, notes="from a test", configuration="a = 1")
    written: list[Message] = [*OTHERS, samples(0, 3), estimates(0, 2)]
    with SessionWriter(tmp_path / "a.mcap", run) as writer:
        for message in written:
            writer.write(message)
            writer.flush()
    session = open_session(tmp_path / "a.mcap")
    read = [recorded.message for recorded in session.messages()]
    assert session.info == run
    assert [encode(message) for message in read] == [encode(message) for message in (run, *written)]
    assert session.lost == ()


def test_other_tools_can_decode_it(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", run_info("bench1", 256.0)) as writer:
        writer.write(samples(0, 10))
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = [(s.name if s else "", c.topic) for s, c, _ in reader.iter_messages()]
        summary = reader.get_summary()
    assert sorted(found) == [("rigwatch.RunInfo", "run"), ("rigwatch.SampleBlock", "samples")]
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 2


@pytest.mark.parametrize("size", [1, 3, 8, 100, 5000])
def test_blocks_of_any_size_are_merged_and_no_sample_changes(tmp_path: Path, size: int) -> None:
    with SessionWriter(tmp_path / "a.mcap", run_info("bench1", 256.0), sync=False) as writer:
        for seq in range(0, 10_000, size):
            writer.write(samples(seq, min(size, 10_000 - seq)))
    session = open_session(tmp_path / "a.mcap")
    merged = list(session.samples(size=20_000))
    assert len(merged) == 1
    assert same(merged[0], samples(0, 10_000))
    lengths = [len(item.message) for item in session.messages(["samples"])]  # type: ignore[arg-type]
    assert sum(lengths) == 10_000
    assert max(lengths) <= 5000


def test_nothing_is_merged_across_a_gap_or_a_restart(tmp_path: Path) -> None:
    written = [samples(0, 10), samples(10, 5), samples(20, 5), samples(25, 5, boot=8)]
    with SessionWriter(tmp_path / "a.mcap", run_info("bench1", 256.0)) as writer:
        for block in written:
            writer.write(block)
    read = list(open_session(tmp_path / "a.mcap").samples())
    assert [(block.boot, block.seq, len(block)) for block in read] == [
        (7, 0, 15),
        (7, 20, 5),
        (8, 25, 5),
    ]


def test_an_operators_command_keeps_its_place_between_samples(tmp_path: Path) -> None:
    command = AlarmCommand("*", "reset", "anna", T0)
    with SessionWriter(tmp_path / "a.mcap", run_info("bench1", 256.0)) as writer:
        for message in (samples(0, 5), samples(5, 5), command, samples(10, 5)):
            writer.write(message)
    names = [item.topic.name for item in open_session(tmp_path / "a.mcap").messages()]
    assert names == ["run", "samples", "commands", "samples"]


def test_a_sample_written_twice_is_read_once(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", run_info("bench1", 256.0)) as writer:
        for block in (samples(0, 10), samples(5, 10), samples(0, 3), samples(15, 1)):
            writer.write(block)
    (block,) = open_session(tmp_path / "a.mcap").samples()
    assert same(block, samples(0, 16))


def test_a_span_of_time_cuts_blocks_at_the_sample(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", run_info("bench1", 256.0)) as writer:
        writer.write(samples(0, 1000))
    session = open_session(tmp_path / "a.mcap")
    (block,) = session.samples(start=T0 + 100 * STEP, end=T0 + 200 * STEP)
    assert same(block, samples(100, 100))
    (item,) = session.messages(["samples"], start=T0 + 990 * STEP)
    assert same(item.message, samples(990, 10))  # type: ignore[arg-type]


def test_arrays_are_aligned_and_writable(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", run_info("b", 256.0)) as writer:
        writer.write(samples(0, 3))
    session = open_session(tmp_path / "a.mcap")
    (item,) = session.messages(["samples"])
    for block in (next(session.samples()), item.message):
        assert isinstance(block, SampleBlock)
        arrays = [block.t_ns, block.device_us, *(c.values for c in block.channels)]
        assert all(array.flags.aligned and array.flags.writeable for array in arrays)


def test_a_folder_is_read_as_one_session(tmp_path: Path) -> None:
    for number in range(3):
        path = tmp_path / f"{number:06d}.mcap"
        with SessionWriter(path, run_info("bench1", 256.0)) as writer:
            writer.write(samples(number * 100, 100))
    (block,) = open_session(tmp_path).samples()
    assert same(block, samples(0, 300))


def test_opening_a_session_reads_its_description_which_is_not_searched_again(
    tmp_path: Path,
) -> None:
    run = run_info("bench1", 256.0, t_ns=T0)
    with SessionWriter(tmp_path / "a.mcap", run):
        pass
    session = open_session(tmp_path / "a.mcap")
    (tmp_path / "a.mcap").unlink()
    assert session.info == run


def test_an_existing_file_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_text("precious")
    with pytest.raises(SessionError, match=r"a\.mcap: the file exists already"):
        SessionWriter(path, run_info("bench1", 256.0))
    assert path.read_text() == "precious"


ROOT = Path(__file__).parents[2]
KILLED = """
import sys
from tests.wire.test_session_files import samples
from rigwatch.wire.session import SessionWriter, run_info
writer = SessionWriter(sys.argv[1], run_info("bench1", 256.0))
seq = 0
while True:
    for _ in range(16):
        writer.write(samples(seq, 8))
        seq += 8
    writer.flush()
    print(seq, flush=True)
"""


def test_kill_9_leaves_everything_up_to_the_last_flush(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    command = [sys.executable, "-c", KILLED, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdout is not None
        flushed = [int(process.stdout.readline()) for _ in range(20)][-1]
        os.kill(process.pid, signal.SIGKILL)
    session = open_session(path)
    (block,) = session.samples(size=1 << 40)
    assert len(block) >= flushed
    assert same(block, samples(0, len(block)))
    assert session.info.rig == "bench1"

"""What is in a session file, when it reaches the disk, and what a failing disk leaves of it."""

import errno
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Message as McapMessage

from rigwatch.version import __version__
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import (
    TOPICS,
    AlarmCommand,
    Column,
    EstimateBlock,
    Event,
    Message,
    SampleBlock,
)
from rigwatch.wire.messages.protobuf_schema import file_descriptor_set, type_name
from rigwatch.wire.session import LARGEST_BLOCK, SessionWriter, open_session, run_info
from rigwatch.wire.session.chunks import LARGEST_CHUNK
from rigwatch.wire.session.merging import merge_pending
from rigwatch.wire.session.writer import SPILL, message_time
from tests.recorder.full_disk import largest_file

RUN = run_info("bench1", 256.0, t_ns=1)
Write = Callable[[int, bytes], int]


def samples(seq: int, n: int, device: str = "rig", begin_ns: int = 0) -> SampleBlock:
    index = np.arange(seq, seq + n)
    column = Column("voltage", "V", index / 7.0, np.zeros(n, np.uint8))
    return SampleBlock(device, 7, seq, index * 3906, begin_ns + index * 3_906_250, (column,))


def estimates(seq: int, n: int) -> EstimateBlock:
    index = np.arange(seq, seq + n)
    return EstimateBlock("rig", 7, seq, index * 3_906_250, (Column("theta1", "", index / 3.0),))


def command(t_ns: int = 5) -> AlarmCommand:
    return AlarmCommand("*", "reset", "anna", t_ns)


def event(t_ns: int = 6) -> Event:
    return Event("daq", t_ns, "info", "REPLUG", "the line came back")


def spans(messages: list[Message]) -> list[tuple[str, int, int]]:
    """Each block as (device, first sample, samples), other messages as (class, 0, 0)."""
    return [
        (m.device, m.seq, len(m))
        if isinstance(m, SampleBlock | EstimateBlock)
        else (type(m).__name__, 0, 0)
        for m in messages
    ]


# ---- what is in the file --------------------------------------------------------------------


def test_the_head_of_a_file_describes_itself_to_other_tools(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", RUN) as writer:
        writer.write(samples(0, 3))
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file)
        header, summary = reader.get_header(), reader.get_summary()
    assert (header.profile, header.library) == ("rigwatch", f"rigwatch {__version__}")
    assert summary is not None
    assert [(c.id, c.topic) for c in summary.channels.values()] == [
        (number, topic.name) for number, topic in enumerate(TOPICS, start=1)
    ]
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert (channel.message_encoding, schema.encoding) == ("protobuf", "protobuf")
        assert channel.metadata == {"rigwatch_format": "1"}
        assert schema.data == file_descriptor_set()
    described = {s.name for s in summary.schemas.values()}
    assert described == {type_name(topic.message) for topic in TOPICS}
    assert {index.compression for index in summary.chunk_indexes} == {"zstd"}


def logged(path: Path) -> dict[str, McapMessage]:
    with path.open("rb") as file:
        return {channel.topic: m for _, channel, m in make_reader(file).iter_messages()}


def test_a_message_stands_at_its_time_and_a_block_at_its_first_sample(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", RUN) as writer:
        for message in (samples(8, 3, begin_ns=10**9), event(77), command(-3)):
            writer.write(message)
    found = logged(tmp_path / "a.mcap")
    first = 10**9 + 8 * 3_906_250
    assert (found["samples"].log_time, found["samples"].publish_time) == (first, first)
    assert (found["events"].log_time, found["events"].publish_time) == (77, 77)
    assert found["commands"].log_time == 0, "a time before 1970 has no place in the file"
    assert message_time(samples(0, 0)) == 0


def test_run_info_is_signed_by_this_version_and_dated_now() -> None:
    before = time.time_ns()
    run = run_info("rig", 128.0, notes="n", configuration="a = 1", configuration_sha256="ab")
    assert before <= run.t_ns <= time.time_ns()
    assert (run.rig, run.sample_rate_hz, run.notes) == ("rig", 128.0, "n")
    assert (run.configuration, run.configuration_sha256) == ("a = 1", "ab")
    assert run.software == f"rigwatch {__version__}"
    plain = run_info("rig", 128.0, t_ns=5)
    assert plain.t_ns == 5
    assert (plain.notes, plain.configuration, plain.configuration_sha256) == ("", "", "")


# ---- how blocks are merged ------------------------------------------------------------------


def test_blocks_of_each_device_and_kind_are_joined_at_the_place_of_their_first() -> None:
    written = [
        samples(0, 2), event(), samples(0, 3, "other"), estimates(0, 1), samples(2, 2),
        estimates(1, 4), samples(3, 1, "other"), samples(4, 1), samples(9, 0),
    ]  # fmt: skip
    assert spans(merge_pending(written)) == [
        ("rig", 0, 5),
        ("Event", 0, 0),
        ("other", 0, 4),
        ("rig", 0, 5),
    ]


def test_a_command_parts_the_blocks_of_every_device() -> None:
    written = [samples(0, 2), estimates(0, 2), command(), samples(2, 2), estimates(2, 2)]
    merged = spans(merge_pending(written))
    assert [(first, n) for _, first, n in merged] == [(0, 2), (0, 2), (0, 0), (2, 2), (2, 2)]


def test_a_joined_block_is_as_long_as_allowed_and_not_longer() -> None:
    written = [samples(seq, 5) for seq in range(0, 50, 5)]
    assert [n for _, _, n in spans(merge_pending(written, 15))] == [15, 15, 15, 5]
    assert [n for _, _, n in spans(merge_pending(written, 14))] == [10] * 5


def test_blocks_that_do_not_continue_each_other_stay_apart_and_joining_goes_on() -> None:
    merged = merge_pending([samples(0, 2), samples(5, 2), samples(7, 2), samples(20, 1)])
    assert spans(merged) == [("rig", 0, 2), ("rig", 5, 4), ("rig", 20, 1)]


@pytest.mark.parametrize("made", [samples, estimates])
def test_a_block_larger_than_a_message_may_be_is_parted(made: Callable[..., Message]) -> None:
    merged = merge_pending([made(0, 2 * LARGEST_BLOCK + 1)])
    assert [(first, n) for _, first, n in spans(merged)] == [
        (0, LARGEST_BLOCK),
        (LARGEST_BLOCK, LARGEST_BLOCK),
        (2 * LARGEST_BLOCK, 1),
    ]


# ---- when it reaches the disk ---------------------------------------------------------------


def test_what_was_flushed_is_on_the_disk_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = SessionWriter(path, RUN)
    head = path.stat().st_size
    assert writer.size == head > 0
    writer.write(samples(0, 8))
    assert (path.stat().st_size, len(writer.pending)) == (head, 1)
    writer.flush()
    assert writer.size == path.stat().st_size > head
    assert writer.pending == []
    size = writer.size
    writer.flush()
    assert writer.size == path.stat().st_size == size, "nothing new, nothing written"
    writer.abandon()
    session = open_session(path)
    assert [len(block) for block in session.samples()] == [8]
    assert session.unclosed


def test_many_waiting_samples_are_flushed_without_being_told(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", RUN, sync=False) as writer:
        for _ in range(2):
            writer.write(samples(0, SPILL // 2))
            writer.write(estimates(0, SPILL // 2 - 1))
            assert len(writer.pending) == 2
            writer.write(samples(SPILL, 1))
            assert writer.pending == []


@pytest.mark.parametrize(("told", "waits"), [({}, 3), ({"sync": True}, 3), ({"sync": False}, 0)])
def test_each_flush_waits_for_the_disk_unless_told_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: dict[str, bool], waits: int
) -> None:
    synced: list[int] = []
    whole, fsync = tmp_path / "a.mcap", os.fsync

    def watched(descriptor: int) -> None:
        fsync(descriptor)
        synced.append(whole.stat().st_size)

    monkeypatch.setattr(os, "fsync", watched)
    with SessionWriter(whole, RUN, **told) as writer:
        writer.write(samples(0, 8))
        writer.flush()
    assert len(synced) == waits
    assert synced == sorted(set(synced)), "only after the bytes were written"


def test_closing_twice_and_a_failure_inside_leave_a_readable_file(tmp_path: Path) -> None:
    with SessionWriter(tmp_path / "a.mcap", RUN) as writer:
        writer.write(samples(0, 8))
    writer.close()
    writer.abandon()
    assert open_session(tmp_path / "a.mcap").unclosed == ()
    with pytest.raises(ZeroDivisionError):
        _fail_while_writing(tmp_path / "b.mcap")
    assert open_session(tmp_path / "b.mcap").unclosed
    assert list(open_session(tmp_path / "b.mcap").samples()) == []


def _fail_while_writing(path: Path) -> None:
    with SessionWriter(path, RUN) as writer:
        writer.write(samples(0, 8))
        raise ZeroDivisionError


def test_a_closed_file_is_given_back_to_the_kernel(tmp_path: Path) -> None:
    def held() -> set[str]:
        return {str(one.readlink()) for one in Path("/proc/self/fd").iterdir() if one.is_symlink()}

    path = tmp_path / "a.mcap"
    writer = SessionWriter(path, RUN)
    assert str(path) in held()
    writer.close()
    assert str(path) not in held()


def test_others_may_read_a_session_and_not_write_it(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        SessionWriter(tmp_path / "a.mcap", RUN).close()
    finally:
        os.umask(before)
    assert (tmp_path / "a.mcap").stat().st_mode & 0o777 == 0o644


# ---- a disk that fails ----------------------------------------------------------------------


def test_a_place_where_no_file_can_be_is_one_plain_line(tmp_path: Path) -> None:
    path = tmp_path / "none" / "a.mcap"
    with pytest.raises(SessionError) as refused:
        SessionWriter(path, RUN)
    assert str(refused.value) == f"{path}: cannot be written: no such file or directory"


def test_an_existing_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.touch()
    with pytest.raises(SessionError) as refused:
        SessionWriter(path, RUN)
    assert str(refused.value) == f"{path}: the file exists already and is not overwritten"


def test_a_file_whose_head_cannot_be_written_is_taken_away(tmp_path: Path) -> None:
    with largest_file(10), pytest.raises(SessionError, match="cannot be written: file too large"):
        SessionWriter(tmp_path / "a.mcap", RUN)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_flush_leaves_the_file_as_it_was_and_the_messages_in_hand(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = SessionWriter(path, RUN)
    writer.write(samples(0, 8))
    writer.flush()
    size = writer.size
    writer.write(samples(8, 4))
    with largest_file(size + 100), pytest.raises(SessionError, match=r"a\.mcap: cannot be written"):
        writer.flush()
    assert path.stat().st_size == writer.size == size, "no half of a chunk"
    assert spans(writer.pending) == [("rig", 8, 4)]
    writer.abandon()
    assert [len(block) for block in open_session(path).samples()] == [8]


def test_a_disk_that_fails_while_closing_leaves_what_was_flushed(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = SessionWriter(path, RUN)
    writer.write(samples(0, 8))
    writer.flush()
    with largest_file(writer.size), pytest.raises(SessionError):
        writer.close()
    writer.close()
    assert [len(block) for block in open_session(path).samples()] == [8]


def test_a_kernel_that_takes_few_bytes_at_a_time_gets_them_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write: Write = os.write
    monkeypatch.setattr(os, "write", lambda file, data: write(file, bytes(data[:100])))
    with SessionWriter(tmp_path / "a.mcap", RUN) as writer:
        writer.write(samples(0, 100))
        assert writer.size == (tmp_path / "a.mcap").stat().st_size
    assert [len(block) for block in open_session(tmp_path / "a.mcap").samples()] == [100]


@pytest.mark.parametrize(
    ("failure", "reason"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "no space left on the disk"),
        (OSError(errno.EROFS, "Read-only file system"), "the disk is read-only"),
        (OSError(errno.EIO, "Input/output error"), "input/output error"),
        (OSError("without a number"), "without a number"),
    ],
)
def test_the_reason_of_a_failing_disk_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: OSError, reason: str
) -> None:
    path = tmp_path / "a.mcap"
    writer = SessionWriter(path, RUN)

    def fails(descriptor: int, data: bytes) -> int:
        raise failure

    monkeypatch.setattr(os, "write", fails)
    writer.write(samples(0, 8))
    with pytest.raises(SessionError) as told:
        writer.flush()
    writer.abandon()
    assert str(told.value) == f"{path}: cannot be written: {reason}"


def test_a_flood_of_long_texts_costs_nothing_of_what_is_beside_it(tmp_path: Path) -> None:
    path, count = tmp_path / "flood.mcap", LARGEST_CHUNK // 250_000 + 10
    flood = [Event("eve", i, "info", "X", "x" * 250_000) for i in range(count)]
    with SessionWriter(path, RUN) as writer:
        writer.write(samples(0, 100))
        for one in flood:
            writer.write(one)
        writer.write(samples(100, 100))
        writer.flush()
    session = open_session(path)
    assert [(one.seq, len(one)) for one in session.samples()] == [(0, 200)]
    kept = [one.message.t_ns for one in session.messages(["events"])]
    assert kept == [*range(count)]

"""Messages survive the way to bytes and back, and foreign bytes are refused."""

import importlib.util
import json
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from google.protobuf import descriptor_pb2
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages.message_types import (
    MESSAGE_TYPES,
    Alarm,
    AlarmCommand,
    Column,
    EstimateBlock,
    Event,
    Gap,
    Health,
    Message,
    ModelChange,
    RunInfo,
    SampleBlock,
)
from rigwatch.wire.messages.protobuf import decode, encode
from rigwatch.wire.messages.protobuf_schema import file_descriptor_set, type_name
from rigwatch.wire.messages.topics import TOPICS

SCHEMA = Path(__file__).with_name("schema.txt")
BYTES: dict[str, str] = json.loads(Path(__file__).with_name("messages.json").read_text())
TIMES = np.array([1_700_000_000_000_000_000, 1_700_000_000_003_906_250])
COLUMN = Column("voltage", "V", np.array([1.5, -0.1]), np.array([0, 2], np.uint8))
EXAMPLES: dict[type[Message], Message] = {
    type(message): message
    for message in (
        SampleBlock("rig", 2**32 - 1, 7, np.array([5, 3911]), TIMES, (COLUMN,)),
        EstimateBlock("rig", 1, 7, TIMES, (Column("theta1", "", np.array([1.0, np.nan])),)),
        Gap("rig", 1, 8, 9, 10, "monitor", "ring too short"),
        Health("daq", 1, "running", "", {"rate_hz": 256.0, "lost_samples": 0.0}),
        Event("daq", 1, "warning", "CLOCK STEP", "the clock stepped back"),
        Alarm(
            "dry_friction",
            "unacknowledged",
            "error",
            "dry friction",
            "check the air bearing",
            "rig",
            1,
            2,
            3,
            1.1,
            -0.1,
            0.1,
            True,
            "",
            1,
        ),
        AlarmCommand("*", "acknowledge", "ann", 5, "seen"),
        RunInfo("bench", 1, 256.0, "[rig]", "ab", "rigwatch 0", "π"),
        ModelChange("rig", 1, 2, 3, "ann", "friction is known", "a = 1", "a = 0"),
    )
}


def same(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype == float)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if hasattr(one, "__dataclass_fields__"):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return one == other


@pytest.mark.parametrize("kind", MESSAGE_TYPES, ids=lambda kind: kind.__name__)
def test_every_message_survives_the_round_trip(kind):
    message = EXAMPLES[kind]
    assert same(decode(kind, encode(message)), message)


@given(hnp.arrays(np.float64, st.integers(0, 40)))
def test_values_are_bit_identical(values):
    block = SampleBlock(
        "rig", 1, 0, np.arange(len(values)), np.arange(len(values)), (Column("a", "", values),)
    )
    back = decode(SampleBlock, encode(block)).channel("a").values
    assert back.tobytes() == values.tobytes()


@given(st.binary(max_size=200))
def test_foreign_bytes_are_a_message_or_a_message_error(data):
    for kind in MESSAGE_TYPES:
        try:
            decode(kind, data)
        except MessageError as error:
            assert kind.__name__ in str(error)  # noqa: PT017


def test_columns_of_different_length_are_refused():
    block = replace(EXAMPLES[SampleBlock], t_ns=TIMES[:1])
    with pytest.raises(MessageError, match="voltage"):
        decode(SampleBlock, encode(block))


def test_an_unknown_word_is_refused():
    with pytest.raises(MessageError, match="acknowledge"):
        decode(AlarmCommand, encode(replace(EXAMPLES[AlarmCommand], action="ignore")))


def test_the_descriptor_set_describes_every_topic():
    bundle = descriptor_pb2.FileDescriptorSet.FromString(file_descriptor_set())
    known = {f"{file.package}.{m.name}" for file in bundle.file for m in file.message_type}
    assert {type_name(topic.message) for topic in TOPICS} <= known


def test_topics_have_names_and_keys_of_their_own():
    assert len({topic.name for topic in TOPICS}) == len(TOPICS) == len({t.key for t in TOPICS})


def test_a_column_is_found_by_name():
    assert EXAMPLES[SampleBlock].channel("voltage") is COLUMN
    with pytest.raises(KeyError):
        EXAMPLES[EstimateBlock].column("voltage")


@pytest.fixture
def started(monkeypatch) -> SimpleNamespace:
    """Schema and codec as a process builds them at its start: no table of another test is left."""
    found = {}
    for name in ("protobuf_schema", "protobuf"):
        spec = importlib.util.find_spec(f"rigwatch.wire.messages.{name}")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        monkeypatch.setitem(sys.modules, spec.name, module)
        found |= vars(module)
    return SimpleNamespace(**found)


def described(message: descriptor_pb2.DescriptorProto) -> list[str]:
    """The fields of a message and of what is nested in it, a line each."""
    kinds = descriptor_pb2.FieldDescriptorProto
    lines = [f"{message.name}{' (entry of a map)' * message.options.map_entry}"]
    for field in message.field:
        word = kinds.Label.Name(field.label)[6:].lower()
        kind = f"{kinds.Type.Name(field.type)[5:].lower()} {field.type_name}".strip()
        lines.append(f"    {field.number} {field.name}: {word} {kind}")
    return lines + [f"    {line}" for part in message.nested_type for line in described(part)]


def test_files_of_earlier_versions_stay_readable(started):
    """Numbers and types as in every session recorded so far; new fields come at the end."""
    (file,) = descriptor_pb2.FileDescriptorSet.FromString(started.file_descriptor_set()).file
    assert (file.name, file.package, file.syntax) == ("rigwatch.proto", "rigwatch", "proto3")
    lines = [line for message in file.message_type for line in described(message)]
    assert lines == SCHEMA.read_text().splitlines()


@pytest.mark.parametrize("kind", MESSAGE_TYPES, ids=lambda kind: kind.__name__)
def test_a_process_that_has_just_started_speaks_like_the_others(started, kind):
    data = started.encode(EXAMPLES[kind])
    assert same(started.decode(kind, data), EXAMPLES[kind])
    assert data.hex() == BYTES[kind.__name__]


def test_empty_columns_keep_their_types(started):
    none = np.zeros(0)
    columns = (Column("voltage", "V", none),)
    block = SampleBlock("rig", 1, 0, none.astype(np.int64), none.astype(np.int64), columns)
    assert same(started.decode(SampleBlock, started.encode(block)), block)


def test_what_was_decoded_can_be_changed_and_compared(started):
    health = started.decode(Health, started.encode(EXAMPLES[Health]))
    assert type(health.counters) is dict
    block = started.decode(SampleBlock, started.encode(EXAMPLES[SampleBlock]))
    assert all(c.values.flags.writeable and c.quality.flags.writeable for c in block.channels)


def test_the_same_counters_are_the_same_bytes_in_whatever_order_they_were_counted(started):
    names = [f"counter_{i}" for i in range(20)]
    data = {
        started.encode(replace(EXAMPLES[Health], counters=dict.fromkeys(some, 1.0)))
        for some in (names, names[::-1])
    }
    assert len(data) == 1


def test_what_is_wrong_with_the_bytes_is_reported(started):
    odd = started.encode(replace(EXAMPLES[AlarmCommand], action="ignore"))
    with pytest.raises(MessageError) as told:
        started.decode(AlarmCommand, odd)
    words = "found 'ignore', expected one of acknowledge, reset, shelve, unshelve"
    assert str(told.value) == f"AlarmCommand: {len(odd)} bytes cannot be decoded: {words}"
    with pytest.raises(MessageError, match=r"^Event: 3 bytes cannot be decoded: "):
        started.decode(Event, b"\xff\xff\xff")


@pytest.mark.parametrize(
    ("block", "wrong"),
    [
        (replace(EXAMPLES[SampleBlock], device_us=TIMES[:1]), r"\['device_us'\]"),
        (replace(EXAMPLES[SampleBlock], t_ns=TIMES[:1], device_us=TIMES[:1]), r"\['voltage'\]"),
        (
            replace(
                EXAMPLES[SampleBlock],
                channels=(COLUMN, replace(COLUMN, quality=COLUMN.quality[:1])),
            ),
            r"\['voltage'\]",
        ),
        (replace(EXAMPLES[EstimateBlock], t_ns=TIMES[:1]), r"\['theta1'\]"),
    ],
)
def test_columns_that_do_not_fit_are_named(started, block, wrong):
    kind = type(block)
    expected = f"^{kind.__name__}: columns {wrong} do not have {len(block)} samples$"
    with pytest.raises(MessageError, match=expected):
        started.decode(kind, started.encode(block))


def test_a_block_without_device_times_or_quality_is_whole(started):
    column = replace(COLUMN, quality=np.zeros(0, np.uint8))
    block = replace(EXAMPLES[SampleBlock], device_us=np.zeros(0, np.int64), channels=(column,))
    assert same(started.decode(SampleBlock, started.encode(block)), block)


def test_the_tag_before_each_field_is_its_number_and_wire_type(started):
    varint, by_length = 0, 2
    assert started.field_tags(SampleBlock) == {
        "device": 1 << 3 | by_length,
        "boot": 2 << 3 | varint,
        "seq": 3 << 3 | varint,
        "device_us": 4 << 3 | by_length,
        "t_ns": 5 << 3 | by_length,
        "channels": 6 << 3 | by_length,
    }
    assert started.field_tags(Column)["values"] == 3 << 3 | by_length
    assert started.field_tags(Alarm)["first_out"] == 13 << 3 | varint


FIRST_MESSAGES = """
import sys, threading
import numpy as np
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.messages.protobuf import encode

sys.setswitchinterval(1e-6)
times = np.arange(2, dtype=np.int64)
column = Column("a", "V", np.zeros(2), np.zeros(2, np.uint8))
block = SampleBlock("rig", 1, 0, times, times, (column,))
together, sent = threading.Barrier(16), []

def send():
    together.wait()
    sent.append(encode(block))

threads = [threading.Thread(target=send) for _ in range(16)]
for thread in threads: thread.start()
for thread in threads: thread.join()
assert len(sent) == 16 and len(set(sent)) == 1
"""


def test_threads_that_send_their_first_message_at_once_all_can() -> None:
    done = subprocess.run(
        [sys.executable, "-c", FIRST_MESSAGES], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr

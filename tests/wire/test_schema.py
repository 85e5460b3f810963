"""Messages survive the way to bytes and back, and foreign bytes are refused."""

from dataclasses import fields, replace

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
from rigwatch.wire.messages.protobuf import decode, encode, file_descriptor_set, type_name
from rigwatch.wire.messages.topics import TOPICS

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

"""The fast reader and writer of blocks say what the general ones say, for any bytes."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import (
    columns_of,
    concatenate,
    continues,
    cut,
    decode_all,
    merged,
    packed,
    pieces,
)
from rigwatch.wire.messages import decode as quick_decode
from rigwatch.wire.messages import encode as quick_encode
from rigwatch.wire.messages.message_types import Column, ColumnTable, EstimateBlock, SampleBlock
from rigwatch.wire.messages.packed import decode_block
from rigwatch.wire.messages.packed_encoding import LENGTHS_KEPT, _around
from rigwatch.wire.messages.protobuf import decode, encode
from rigwatch.wire.session.joined_blocks import joined_blocks

Block = SampleBlock | EstimateBlock
NAMES = st.sampled_from(["voltage", "position", "", "θ1", "x" * 200])
INTEGERS = st.integers(-(2**62), 2**62)


@st.composite
def blocks(draw: st.DrawFn) -> Block:
    n = draw(st.sampled_from([0, 1, 2, 15, 16, 17, 128, 300]))
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    columns = tuple(
        Column(
            draw(NAMES),
            draw(NAMES),
            rng.normal(size=n) * np.array([1.0, np.nan, np.inf])[rng.integers(0, 3, n)],
            rng.integers(0, 256, n if draw(st.booleans()) else 0).astype(np.uint8),
        )
        for _ in range(draw(st.integers(0, 4)))
    )
    t_ns = rng.integers(-(2**62), 2**62, n)
    device, boot, seq = draw(NAMES), draw(INTEGERS), draw(INTEGERS)
    if draw(st.booleans()):
        table = _table(columns) if columns and draw(st.booleans()) else columns
        return EstimateBlock(device, boot, seq, t_ns, table)
    return SampleBlock(device, boot, seq, t_ns[::-1].copy(), t_ns, columns)


def _table(columns: tuple[Column, ...]) -> ColumnTable:
    """The same columns without their quality, as rows of one array."""
    names = tuple((column.name, column.unit) for column in columns)
    return ColumnTable(names, np.array([column.values for column in columns]))


def said(kind: type[Block], data: bytes, fast: bool) -> bytes | str:
    if not fast:
        return said_by(decode, kind, data)
    views = said_by(decode_block, kind, data)
    assert said_by(quick_decode, kind, data) == views
    found, rejected = decode_all(kind, [data])
    assert [*map(encode, found), *["refused"] * rejected] == [views]
    return views


def said_by(read: Callable[..., Block], kind: type[Block], data: bytes) -> bytes | str:
    try:
        return encode(read(kind, data))
    except MessageError:
        return "refused"


@settings(max_examples=100, deadline=None)
@given(st.lists(blocks(), min_size=1, max_size=5))
def test_blocks_come_back_whatever_came_before(several: list[Block]) -> None:
    for block in (*several, *several):
        data = encode(block)
        assert said(type(block), data, fast=True) == data


def joined(several: Iterable[Block]) -> list[Block]:
    """The blocks, joined where one continues another and neither is empty."""
    found: list[Block] = []
    for block in several:
        if found and len(block) and len(found[-1]) and continues(found[-1], block):
            found[-1] = concatenate([found[-1], block])  # type: ignore[type-var]
        else:
            found.append(block)
    return found


@settings(max_examples=100, deadline=None)
@given(st.lists(blocks(), min_size=1, max_size=3), st.integers(1, 40), st.data())
def test_blocks_that_wait_together_are_joined_as_single_ones_would_be(
    several: list[Block], size: int, draw: st.DataObject
) -> None:
    kind = type(several[0])
    parts = [part for block in several if type(block) is kind for part in pieces(block, size)]
    kept = [part for part in parts if len(parts) < 3 or draw.draw(st.integers(0, 9))]
    payloads = [encode(part) for part in kept]
    bad = draw.draw(st.integers(0, len(payloads)))
    payloads.insert(bad, b"\xff")
    found, rejected = decode_all(kind, payloads)
    assert rejected == 1
    expected = [*joined(kept[:bad]), *joined(kept[bad:])]
    assert [encode(one) for one in found] == [encode(one) for one in expected]
    for block in found:
        for column in columns_of(block):
            assert column.values.flags.writeable
            assert column.values.flags.aligned


@settings(max_examples=100, deadline=None)
@given(st.lists(blocks(), min_size=1, max_size=3), st.integers(1, 9), st.data())
def test_blocks_of_a_recording_are_those_read_one_by_one(
    several: list[Block], size: int, draw: st.DataObject
) -> None:
    kind = type(several[0])
    parts = [part for block in several if type(block) is kind for part in pieces(block, size)]
    kept = [part for part in parts if draw.draw(st.integers(0, 19))]
    payloads = [encode(part) for part in kept]
    at_once = list(joined_blocks(kind, payloads, draw.draw(st.sampled_from([1, 50, 10_000]))))
    one_by_one = merged([decode_block(kind, data) for data in payloads], 10_000)  # type: ignore[type-var]
    expected = [encode(block) for block in one_by_one]
    assert [encode(block) for block in merged(at_once, 10_000)] == expected  # type: ignore[type-var]


def test_recorded_blocks_of_changing_lengths_are_joined_at_once() -> None:
    lengths = [102, 103] * 20
    begins = np.cumsum([0, *lengths])
    whole = _samples(begins[-1])
    payloads = [encode(cut(whole, *span)) for span in pairwise(begins.tolist())]
    (block,) = joined_blocks(SampleBlock, payloads, len(whole))
    assert encode(block) == encode(whole)


@pytest.mark.parametrize("place", [0, 5, 19])
def test_of_recorded_blocks_that_follow_only_a_strange_one_stands_alone(place: int) -> None:
    whole = _samples(200)
    payloads = [encode(part) for part in pieces(whole, 10)]
    strange = replace(cut(whole, 10 * place, 10 * place + 10), device="gir")
    payloads[place] = encode(strange)
    found = list(joined_blocks(SampleBlock, payloads, 1000))
    assert [len(block) for block in found if block.device == "gir"] == [10]
    assert sum(map(len, found)) == len(whole)


def test_a_recorded_block_that_is_none_is_refused_as_it_comes() -> None:
    payloads = [encode(part) for part in pieces(_samples(200), 10)]
    at = bytes(payloads[7]).index(b"voltage")
    payloads[7] = payloads[7][: at - 2] + b"\xff\xff" + payloads[7][at:]
    with pytest.raises(MessageError):
        list(joined_blocks(SampleBlock, payloads, 1000))


def _samples(n: int) -> SampleBlock:
    """Samples from number 1000 on, whose numbers take two bytes."""
    numbers = np.arange(n, dtype=np.int64)
    quality = (numbers % 7).astype(np.uint8)
    columns = (Column("voltage", "V", np.sin(numbers), quality), Column("x", "m", np.cos(numbers)))
    return SampleBlock("rig", 5, 1000, numbers, 10 * numbers, columns)


def test_devices_that_measure_the_same_share_a_layout() -> None:
    packed._layouts.clear()
    for name in ("rig-a", "rig-b", "rig-c"):
        block = SampleBlock(name, 1, 2, np.array([5]), np.array([7]), ())
        assert quick_decode(SampleBlock, encode(block)).device == name
    assert len(packed._layouts) == 1


@settings(max_examples=200, deadline=None)
@given(blocks())
def test_a_block_has_the_same_bytes_either_way(block: Block) -> None:
    assert quick_encode(block) == encode(block)
    halves = [Column(c.name, c.unit, c.values[::2], c.quality[::2]) for c in columns_of(block)]
    every_second = replace_columns(block, halves)
    assert quick_encode(every_second) == encode(every_second)


def replace_columns(block: Block, columns: list[Column]) -> Block:
    """Every second sample: arrays with gaps between their numbers."""
    t_ns = block.t_ns[::2]
    if isinstance(block, SampleBlock):
        us = block.device_us[::2]
        return SampleBlock(block.device, block.boot, block.seq, us, t_ns, tuple(columns))
    return EstimateBlock(block.device, block.boot, block.seq, t_ns, tuple(columns))


def test_numbers_of_other_types_and_too_large_ones_are_left_to_the_general_encoder() -> None:
    counts = Column("count", "", np.array([1, 2]))
    odd = EstimateBlock("rig", 1, 2, np.array([3, 4], np.int32), (counts,))
    assert quick_encode(odd) == encode(odd)
    large = EstimateBlock("rig", 2**64, 2, np.array([3]), ())
    for one in (quick_encode, encode):
        with pytest.raises(ValueError, match="range"):
            one(large)


@settings(max_examples=200, deadline=None)
@given(blocks(), st.data())
def test_damaged_bytes_are_judged_alike(block: Block, draw: st.DataObject) -> None:
    """Behind a checksum such bytes come from another writer, never from the disk."""
    data = bytearray(encode(block))
    said(type(block), bytes(data), fast=True)
    for _ in range(draw.draw(st.integers(1, 3))):
        if data:
            data[draw.draw(st.integers(0, min(60, len(data) - 1)))] = draw.draw(st.integers(0, 255))
    changed = bytes(data)
    assert said(type(block), changed, fast=True) == said(type(block), changed, fast=False)


def test_a_number_that_runs_on_for_ever_is_left_to_the_general_decoder() -> None:
    """The layout of the block before it must not be what decides."""
    block = SampleBlock("voltage", 1, 2**55, np.array([5]), np.array([7]), ())
    data = bytearray(encode(block))
    said(SampleBlock, bytes(data), fast=True)
    start = data.index(0x18) + 1
    data[start : start + 9] = b"\xff" * 9
    changed = bytes(data)
    assert said(SampleBlock, changed, fast=True) == said(SampleBlock, changed, fast=False)


@given(st.binary(max_size=80))
def test_garbage_is_judged_alike(data: bytes) -> None:
    for kind in (SampleBlock, EstimateBlock):
        assert said(kind, data, fast=True) == said(kind, data, fast=False)


def test_heads_of_blocks_of_any_length_fill_no_memory() -> None:
    _around.cache_clear()
    for n in range(1, 2000):
        theta = Column("theta1", "N", np.zeros(n))
        quick_encode(EstimateBlock("rig", 7, 0, np.arange(n), (theta,)))
    assert _around.cache_info().currsize <= LENGTHS_KEPT < 1000

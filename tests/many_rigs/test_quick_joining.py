"""Payloads that wait together make the blocks that they make one by one, to the last bit."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigwatch.wire import quick_joining
from rigwatch.wire.messages import (
    Column,
    ColumnTable,
    EstimateBlock,
    SampleBlock,
    cut,
    decode_all,
    encode,
    gather_with,
)

Block = SampleBlock | EstimateBlock
FATES = [
    "", "", "", "lost", "again", "boot", "device", "back", "flip", "unit", "empty", "other sender",
]  # fmt: skip


@pytest.fixture(autouse=True, scope="module")
def one_by_one_afterwards() -> Iterator[None]:
    quick_joining.join_quickly()
    yield
    gather_with(None)


def whole(kind: type[Block], seq: int, n: int) -> Block:
    random = np.random.default_rng(n)
    t_ns = 10**18 + np.arange(n) * 3_906_250
    if kind is EstimateBlock:
        names = tuple((f"e{k}", "N") for k in range(5))
        return EstimateBlock("rig", 7, seq, t_ns, ColumnTable(names, random.normal(size=(5, n))))
    flags = random.integers(0, 3, (2, n)).astype(np.uint8)
    columns = [Column(f"c{k}", "V", random.normal(size=n), flags[k]) for k in range(2)]
    return SampleBlock("rig", 7, seq, np.arange(n) * 3906, t_ns, tuple(columns))


def sent(block: Block, fate: str, place: int) -> list[bytes]:
    if fate == "unit" and isinstance(block, SampleBlock):
        first, *others = block.channels
        block = replace(block, channels=(replace(first, unit="A"), *others))
    changed: dict[str, Callable[[], list[bytes]]] = {
        "lost": list,
        "again": lambda: [encode(block)] * 2,
        "boot": lambda: [encode(replace(block, boot=8))],
        "device": lambda: [encode(replace(block, device="gir"))],
        "back": lambda: [encode(replace(block, t_ns=block.t_ns - 10**12))],
        "empty": lambda: [encode(cut(block, 0, 0))],
    }
    data = encode(block)
    if fate == "flip":
        at = place % len(data)
        return [data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]]
    return changed.get(fate, lambda: [data])()


@pytest.mark.nightly
@settings(max_examples=300, deadline=None)
@given(
    st.sampled_from([SampleBlock, EstimateBlock]),
    st.sampled_from([0, 1, 60, 8190, 2**31 - 40, 2**62 - 30, -70]),
    st.lists(st.tuples(st.integers(1, 11), st.sampled_from(FATES)), min_size=1, max_size=12),
    st.integers(0, 10**6),
)
def test_they_are_those_read_one_by_one(
    kind: type[Block], seq: int, parts: list[tuple[int, str]], place: int
) -> None:
    block, at, payloads = whole(kind, seq, sum(n for n, _ in parts)), 0, list[bytes]()
    for n, fate in parts:
        payloads += sent(cut(block, at, at + n), fate, place)
        at += n
    decode_all(kind, payloads)  # all layouts are known from here on
    quick = decode_all(kind, payloads)
    gather_with(None)
    try:
        slow = decode_all(kind, payloads)
    finally:
        gather_with(quick_joining.gathered)
    assert quick[1] == slow[1]
    assert [encode(one) for one in quick[0]] == [encode(one) for one in slow[0]]


@pytest.mark.parametrize("kind", [SampleBlock, EstimateBlock])
def test_those_that_simply_follow_are_read_in_one_call(
    kind: type[Block], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = list[bool]()

    def counted(*args: object) -> object:
        found = quick_joining.gathered(*args)  # type: ignore[arg-type]
        calls.append(found is not None)
        return found

    block = whole(kind, 5, 100)
    payloads = [encode(cut(block, at, min(at + 9, 100))) for at in range(0, 100, 9)]
    decode_all(kind, payloads)
    gather_with(counted)  # type: ignore[arg-type]
    try:
        (found,), rejected = decode_all(kind, payloads)
    finally:
        gather_with(quick_joining.gathered)
    assert calls == [True]
    assert not rejected
    assert encode(found) == encode(block)

"""Readers of blocks remember the layouts of late, and not every one that there ever was."""

import gc
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rigwatch.wire.messages import Column, EstimateBlock, cut, decode_all, encode, packed
from rigwatch.wire.messages.recent import Recent


def kept_by(read: Callable[[], object]) -> int:
    """Memory that a function leaves behind [bytes]."""
    gc.collect()
    before = tracemalloc.get_traced_memory()[0]
    read()
    gc.collect()
    return tracemalloc.get_traced_memory()[0] - before


@pytest.fixture(autouse=True)
def layouts_of_few_rigs(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a process of few rigs keeps them, whatever another test has asked of this one."""
    known = Recent[Any, Any](packed.MOST_LAYOUTS, packed.LAYOUTS_ROOM)
    monkeypatch.setattr(packed, "_layouts", known)


def test_layouts_of_blocks_of_any_length_fill_no_memory() -> None:
    lengths = np.random.default_rng(1).permutation(np.arange(1, 500))
    columns = [Column(f"column{k}", "N", np.zeros(500)) for k in range(3)]
    whole = EstimateBlock("rig", 7, 0, np.arange(500), tuple(columns))
    payloads = [encode(cut(whole, 0, int(n))) for n in lengths]
    tracemalloc.start()
    try:
        few = kept_by(lambda: [decode_all(EstimateBlock, [one]) for one in payloads[:100]])
        many = kept_by(lambda: [decode_all(EstimateBlock, [one]) for one in payloads[100:]])
    finally:
        tracemalloc.stop()
    assert 0 < few < 200_000
    assert many < 100_000


def test_a_layout_in_use_is_kept_while_others_come_and_go() -> None:
    usual = encode(EstimateBlock("rig", 7, 0, np.arange(3), ()))
    layout = packed.layout_of(EstimateBlock, usual)
    for n in range(4, 400):
        decode_all(EstimateBlock, [encode(EstimateBlock("rig", 7, 0, np.arange(n), ()))])
        assert packed.layout_of(EstimateBlock, usual) is layout


def test_layouts_of_all_lengths_have_the_names_of_one() -> None:
    columns = tuple(Column(f"column{k}", "N", np.zeros(9)) for k in range(20))
    block = EstimateBlock("rig", 7, 0, np.arange(9), columns)
    one, other = (packed.layout_of(EstimateBlock, encode(cut(block, 0, n))) for n in (3, 9))
    assert one is not other
    assert one.names is other.names
    assert one.plain_names is other.plain_names


def test_what_is_not_asked_for_again_makes_room() -> None:
    recent: Recent[int, str] = Recent(most=4, room=100)
    for key in range(50):
        recent.put(key, f"value {key}", 1)
        assert recent.get(0) == "value 0"
        assert recent.get(key) == f"value {key}"
        assert len(recent) <= 8
    assert recent.get(30) is None


def test_large_values_make_room_by_their_size() -> None:
    recent: Recent[int, str] = Recent(most=1000, room=100)
    for key in range(50):
        recent.put(key, "", 30)
    assert len(recent) <= 6

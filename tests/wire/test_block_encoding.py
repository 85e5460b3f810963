"""Encoding of blocks: what is kept to make it fast has a bound."""

import numpy as np

from rigwatch.wire.messages import encode, packed_encoding
from rigwatch.wire.messages.message_types import Column, EstimateBlock


def test_blocks_of_any_length_fill_no_memory() -> None:
    packed_encoding._around.cache_clear()
    for n in range(1, 2000):
        encode(EstimateBlock("rig", 7, 0, np.arange(n), (Column("theta1", "N", np.zeros(n)),)))
    assert packed_encoding._around.cache_info().currsize <= 512

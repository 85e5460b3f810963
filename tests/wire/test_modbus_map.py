"""The register map: what is put in comes out, and nothing else is taken for it."""

from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.wire.device.modbus_map import (
    HEADER_LENGTH,
    READ_LIMIT,
    Header,
    decode_header,
    decode_slots,
    encode_header,
    encode_slot,
)
from rigwatch.wire.errors import ModbusError

U32 = st.integers(0, 2**32 - 1)
ORDERS = st.sampled_from(["big", "little"])
HEADERS = st.builds(Header, st.integers(1, 16), U32, U32, U32, st.sampled_from([64, 512]))


@given(HEADERS, ORDERS)
def test_header_comes_back(header: Header, order: Literal["big", "little"]) -> None:
    registers = encode_header(header, order)
    assert len(registers) == HEADER_LENGTH
    assert decode_header(registers, order) == header


@given(U32, st.lists(U32, min_size=1, max_size=17), ORDERS)
def test_slots_come_back(first: int, times: list[int], order: Literal["big", "little"]) -> None:
    header = Header(3, 1, first, 0, 512)
    codes = [[-32768, index, 32767] for index in range(len(times))]
    registers = []
    for index, us in enumerate(times):
        registers += encode_slot((first + index) % 2**32, us, codes[index], order)
    found_us, found_codes = decode_slots(registers, first, len(times), header, order)
    assert found_us.tolist() == times
    np.testing.assert_array_equal(found_codes, codes)


def test_the_other_word_order_is_named() -> None:
    registers = encode_header(Header(3, 1, 2, 3, 512), "little")
    with pytest.raises(ModbusError, match=r"not 'big': set word_order = 'little'"):
        decode_header(registers, "big")


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ({0: 7}, "not a device of rigwatch: identification 0x00074757"),
        ({2: 9}, "register map of version 9, expected 1"),
        ({11: 6}, "contradicts itself: 3 channels, 512 slots of 6 registers"),
        ({10: 0}, "contradicts itself"),
    ],
)
def test_a_wrong_header_is_refused(edit: dict[int, int], message: str) -> None:
    registers = encode_header(Header(3, 1, 2, 3, 512))
    for index, value in edit.items():
        registers[index] = value
    with pytest.raises(ModbusError, match=message):
        decode_header(registers)


def test_lengths_are_checked() -> None:
    header = Header(3, 1, 9, 3, 512)
    with pytest.raises(ModbusError, match="a reply of 15 registers, expected 16"):
        decode_header(encode_header(header)[:-1])
    with pytest.raises(ModbusError, match="a reply of 6 registers, expected 7"):
        decode_slots(encode_slot(1, 2, [3, 4, 5])[:-1], 1, 1, header)


def test_another_sample_in_a_slot_is_noticed() -> None:
    with pytest.raises(ModbusError, match="holds sample 513, expected 1"):
        decode_slots(encode_slot(513, 2, [3, 4, 5]), 1, 1, Header(3, 1, 600, 3, 512))


def test_reads_fit_into_a_modbus_reply() -> None:
    header = Header(3, 1, 9, 3, 512)
    assert header.slots_a_read * header.slot_length <= READ_LIMIT
    assert header.address(512) == header.address(0) == HEADER_LENGTH

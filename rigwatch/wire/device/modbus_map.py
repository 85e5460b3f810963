"""The registers in which a Modbus device buffers its samples: a header, and a ring of slots.

Input registers (function 4), 16 bits each; values of 32 bits take two, in an order that differs
between devices::

    0   identification    u32   0x52494757, "RIGW": detects a wrong word order or another device
    2   version of map    u16   1
    3   channels n        u16
    4   boot              u32   drawn by the device when it starts
    6   samples           u32   taken since then; the newest is number samples - 1; wraps
    8   device µs         u32   the device's clock at the newest sample; wraps
    10  slots R           u16   length of the ring, a power of two
    11  slot length       u16   4 + n
    12… reserved up to 15
    16 + (s mod R)·(4 + n)    the slot of sample s:  s u32 | device µs u32 | n codes i16

A poll reads the header and then the slots not read yet, at most 125 registers at a time. Every slot
holds its sample number, so that a late reply, or an overwritten slot, is recognised. A reply is
consistent: the device copies it atomically.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.errors import ModbusError

WordOrder = Literal["big", "little"]

IDENTIFICATION = 0x52494757
VERSION = 1
HEADER_LENGTH = 16
READ_LIMIT = 125
MAX_CHANNELS = READ_LIMIT - 4
_SLOT_HEAD = 4
_U16 = 1 << 16
_U32 = 1 << 32


@dataclass(frozen=True, slots=True)
class Header:
    """The device's header: identification and state of its ring."""

    channels: int
    boot: int
    samples: int
    device_us: int
    slots: int

    @property
    def slot_length(self) -> int:
        """Registers of one slot."""
        return _SLOT_HEAD + self.channels

    @property
    def slots_a_read(self) -> int:
        """Number of slots per read."""
        return READ_LIMIT // self.slot_length

    def address(self, seq: int) -> int:
        """First register of the slot of sample `seq`."""
        return HEADER_LENGTH + seq % self.slots * self.slot_length

    def registers(self) -> int:
        """Registers of the whole map."""
        return HEADER_LENGTH + self.slots * self.slot_length


def encode_header(header: Header, order: WordOrder = "big") -> list[int]:
    """The header's registers."""
    return [
        *_words(IDENTIFICATION, order),
        VERSION,
        header.channels,
        *_words(header.boot, order),
        *_words(header.samples, order),
        *_words(header.device_us, order),
        header.slots,
        header.slot_length,
        *[0] * 4,
    ]


def decode_header(registers: list[int], order: WordOrder = "big") -> Header:
    """The header in `registers`.

    Raises:
        ModbusError: too short, another device, a wrong word order or version, or inconsistent
            sizes.
    """
    _check_length(registers, HEADER_LENGTH)
    _check_identification(registers[0:2], order)
    version, channels, slots, slot_length = (registers[i] for i in (2, 3, 10, 11))
    if version != VERSION:
        raise ModbusError(f"register map of version {version}, expected {VERSION}")
    boot, samples, device_us = (_number(registers[i : i + 2], order) for i in (4, 6, 8))
    header = Header(channels, boot, samples, device_us, slots)
    if not 1 <= channels <= MAX_CHANNELS or slot_length != header.slot_length or not slots:
        sizes = f"{channels} channels, {slots} slots of {slot_length} registers"
        raise ModbusError(f"the device's header contradicts itself: {sizes}")
    return header


def _check_identification(words: list[int], order: WordOrder) -> None:
    if _number(words, order) == IDENTIFICATION:
        return
    other: WordOrder = "little" if order == "big" else "big"
    if _number(words, other) == IDENTIFICATION:
        raise ModbusError(f"the device's word order is not {order!r}: set word_order = {other!r}")
    found = f"identification {_number(words, order):#010x}, expected {IDENTIFICATION:#010x}"
    raise ModbusError(f"not a device of rigwatch: {found}")


def encode_slot(seq: int, device_us: int, codes: list[int], order: WordOrder = "big") -> list[int]:
    """The registers of one sample's slot."""
    return [*_words(seq, order), *_words(device_us, order), *(code % _U16 for code in codes)]


def decode_slots(
    registers: list[int], first: int, count: int, header: Header, order: WordOrder = "big"
) -> tuple[NDArray[np.int64], NDArray[np.int16]]:
    """The samples from `first` on: device microseconds (count,), and codes (count, channels).

    Raises:
        ModbusError: too short or too long, or a slot holds another sample.
    """
    _check_length(registers, count * header.slot_length)
    table = np.array(registers, np.int64).reshape(count, header.slot_length)
    expected = (first + np.arange(count)) % _U32
    found = _numbers(table[:, 0:2], order)
    if (found != expected).any():
        at = int(np.argmax(found != expected))
        raise ModbusError(f"a slot holds sample {found[at]}, expected {expected[at]}")
    return _numbers(table[:, 2:4], order), table[:, _SLOT_HEAD:].astype(np.uint16).view(np.int16)


def _check_length(registers: list[int], expected: int) -> None:
    if len(registers) != expected:
        raise ModbusError(f"a reply of {len(registers)} registers, expected {expected}")


def _words(value: int, order: WordOrder) -> list[int]:
    words = [value // _U16 % _U16, value % _U16]
    return words if order == "big" else words[::-1]


def _number(words: list[int], order: WordOrder) -> int:
    high, low = words if order == "big" else words[::-1]
    return high * _U16 + low


def _numbers(words: NDArray[np.int64], order: WordOrder) -> NDArray[np.int64]:
    high, low = (0, 1) if order == "big" else (1, 0)
    numbers: NDArray[np.int64] = words[:, high] * _U16 + words[:, low]
    return numbers

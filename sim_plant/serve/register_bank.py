"""The device's sample ring as Modbus registers, computed on request."""

import threading
from collections import deque

from rigwatch.wire.device import Header, WordOrder, encode_header, encode_slot
from sim_plant.serve.source import Sent

SLOTS = 512
"""Two seconds at 256 Hz."""


class RegisterBank:
    """The last `SLOTS` samples behind the register map of `modbus_map`.

    Args:
        channels: number of channels.
        order: which 16-bit half of a 32-bit value comes first.
    """

    def __init__(self, channels: int, order: WordOrder = "big") -> None:
        self._order: WordOrder = order
        self._lock = threading.Lock()
        self._header = Header(channels, 0, 0, 0, SLOTS)
        self._slots: deque[list[int]] = deque(
            ([0] * self._header.slot_length for _ in range(SLOTS)), maxlen=SLOTS
        )

    @property
    def size(self) -> int:
        """Registers of the whole map."""
        return self._header.registers()

    def add(self, sent: Sent) -> None:
        """Add samples."""
        if not len(sent):
            return
        rows = zip(sent.seq.tolist(), sent.device_us.tolist(), sent.codes.tolist(), strict=True)
        slots = [encode_slot(seq, us, codes, self._order) for seq, us, codes in rows]
        last = int(sent.seq[-1])
        with self._lock:
            self._slots.extend(slots)
            self._header = Header(
                sent.codes.shape[1],
                sent.boot,
                (last + 1) % (1 << 32),
                int(sent.device_us[-1]),
                SLOTS,
            )

    def read(self, address: int, count: int) -> list[int]:
        """Registers from `address` on, a consistent snapshot."""
        with self._lock:
            head = encode_header(self._header, self._order)
            length = self._header.slot_length
            registers = []
            for register in range(address, address + count):
                if register < len(head):
                    registers.append(head[register])
                    continue
                slot, offset = divmod(register - len(head), length)
                registers.append(self._slot(slot)[offset])
        return registers

    def _slot(self, number: int) -> list[int]:
        """The slot's registers; the newest sample is the last in the deque."""
        age = (self._header.samples - 1 - number) % SLOTS
        return self._slots[SLOTS - 1 - age]

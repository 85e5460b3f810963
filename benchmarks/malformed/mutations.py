"""Mutations of examples: bits, bytes, spans cut, doubled or moved, numbers and brackets put in."""

import random

TOKENS = (
    b"9" * 400, b"[" * 60, b"(" * 60, b"\x00", b"\xff\xff\xff\xff", b"nan", b"1e999", b"-", b"**",
    b"\n", b'"', b"=", b"\xc3", b"{", b"0x", b"'''",
)  # fmt: skip


def mutated(chance: random.Random, examples: tuple[bytes, ...]) -> bytes:
    """An example with one to eight mutations."""
    data = bytearray(chance.choice(examples))
    for _ in range(chance.randint(1, 8)):
        at, kind = chance.randrange(len(data) + 1), chance.randrange(6)
        end = min(len(data), at + chance.randint(1, 64))
        if kind == 0 and at < len(data):
            data[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            del data[at:end]
        elif kind == 2:
            data[at:at] = data[at:end] * chance.randint(1, 20)
        elif kind == 3:
            data[at:at] = chance.choice(TOKENS)
        elif kind == 4:
            data[at:at] = chance.choice(examples)[: chance.randint(1, 200)]
        else:
            data[at:end] = chance.randbytes(end - at)
    return bytes(data)

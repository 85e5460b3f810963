"""Faults of a line, switched while it runs.

A fault acts on the next `count` frames, or permanently if `count` is 0:

    garbage     random bytes in place of the frame, as a wrong baud rate gives
    flip        one bit inverted
    drop        some bytes missing
    insert      some extra bytes
    duplicate   the frame twice
    lose        no frame
    unplug      no line for that many frames
"""

import random
import threading
from collections.abc import Callable
from pathlib import Path

from rigwatch.wire.errors import DeviceError
from sim_plant.serve.pty_line import PtyLine

_Edit = Callable[[bytes, random.Random], bytes]


def _flip(frame: bytes, chance: random.Random) -> bytes:
    edited = bytearray(frame)
    edited[chance.randrange(len(frame) - 1)] ^= 1 << chance.randrange(8)
    return bytes(edited)


def _drop(frame: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(frame) - 1)
    return frame[:at] + frame[at + 1 + chance.randrange(4) :]


def _insert(frame: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(frame))
    return frame[:at] + chance.randbytes(1 + chance.randrange(4)) + frame[at:]


EDITS: dict[str, _Edit] = {
    "garbage": lambda frame, chance: chance.randbytes(len(frame)),
    "flip": _flip,
    "drop": _drop,
    "insert": _insert,
    "duplicate": lambda frame, _: frame + frame,
    "lose": lambda _frame, _chance: b"",
}
NAMES = (*EDITS, "unplug")


class LineFaults:
    """The faults of one line; may be switched from another thread.

    Args:
        seed: seed of their random parts.
    """

    def __init__(self, seed: int = 1) -> None:
        self._chance = random.Random(seed)
        self._active: dict[str, int] = {}
        self._lock = threading.Lock()
        self._new_link: Path | None = None

    def start(self, name: str, count: int = 0, link: Path | None = None) -> None:
        """Apply the fault `name` to the next `count` frames; 0 is permanent.

        Args:
            name: one of `NAMES`.
            count: number of frames.
            link: name under which the line comes back after "unplug".

        Raises:
            DeviceError: there is no such fault.
        """
        if name not in NAMES:
            raise DeviceError(f"line fault {name!r}: expected one of {', '.join(NAMES)}")
        with self._lock:
            self._active[name] = count if count > 0 else -1
            self._new_link = link

    def stop(self, name: str) -> None:
        """End the fault `name`."""
        with self._lock:
            self._active.pop(name, None)

    def apply(self, frame: bytes) -> bytes:
        """The bytes sent in place of `frame`."""
        with self._lock:
            for name in [name for name in self._active if name in EDITS]:
                frame = EDITS[name](frame, self._chance) if len(frame) > 1 else frame
                self._use_up(name)
        return frame

    def switch(self, line: PtyLine) -> None:
        """Plug or unplug the line as that fault requires; called once per frame."""
        with self._lock:
            if "unplug" not in self._active:
                if not line.plugged:
                    line.plug(self._new_link)
                return
            if line.plugged:
                line.unplug()
            self._use_up("unplug")

    def _use_up(self, name: str) -> None:
        if self._active[name] > 0:
            self._active[name] -= 1
            if self._active[name] == 0:
                del self._active[name]

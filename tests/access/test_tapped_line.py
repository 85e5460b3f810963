"""Somebody on the network between a process and the router reads and changes what passes."""

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rigwatch.wire.bus import connect
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.messages import EVENTS, Event, Gap, SampleBlock
from rigwatch.wire.rig_config import load_rig
from tests.access.secured_rig import SecuredRig, make_keys
from tests.bus.rig import TestRig
from tests.bus.samples import is_intact
from tests.waiting import PATIENCE, eventually

SECRET = "the spring of press seven is cracked"
BOOT, CHANGES, UNTOUCHED = 5, 3, 40
"""Bits changed in all, and pieces of each connection before one is."""
Edit = Callable[[int, bytes], bytes]


class TappedLine:
    """A TCP line to a port, whose bytes are kept and may be changed on their way to the client.

    Args:
        target: the router's port.
        edit: called with the number of a piece of its connection, and the piece.
    """

    def __init__(self, target: int, edit: Edit = lambda _number, piece: piece) -> None:
        self.seen = bytearray()
        self._target, self._edit = target, edit
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listener.getsockname()[1])
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> "TappedLine":
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                far = socket.create_connection(("127.0.0.1", self._target))
                for ends in ((near, far, False), (far, near, True)):
                    threading.Thread(target=self._pump, args=ends, daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket, edited: bool) -> None:
        number = 0
        with contextlib.suppress(OSError):
            while piece := source.recv(65536):
                self.seen += piece
                sink.sendall(self._edit(number, piece) if edited else piece)
                number += 1
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)


@pytest.fixture(params=["with keys", "without keys"])
def rig(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[TestRig]:
    keys = request.param == "with keys"
    made = SecuredRig(tmp_path, make_keys(tmp_path / "keys")) if keys else TestRig(tmp_path)
    with made:
        made.router()
        yield made


def test_with_keys_nobody_reads_along(rig: TestRig) -> None:
    with TappedLine(rig.listen) as line:
        far = connect(load_rig(rig.configure("far.toml", line.port)), "recorder", PATIENCE)
        events, near = far.subscribe(EVENTS), rig.bus("monitor")

        def heard() -> bool:
            near.publish(EVENTS, Event("monitor", 1, "info", "TEST", SECRET))
            return SECRET in [event.text for event in events.drain()]

        eventually(heard, "the event comes through")
        far.close()
        assert (SECRET.encode() in line.seen) is not isinstance(rig, SecuredRig)


def test_with_keys_a_changed_bit_reaches_nobody(tmp_path: Path) -> None:
    changed = 0

    def flip(number: int, piece: bytes) -> bytes:
        nonlocal changed
        if number < UNTOUCHED or changed == CHANGES:
            return piece
        changed += 1
        return piece[:-1] + bytes([piece[-1] ^ 1])

    with (
        SecuredRig(tmp_path, make_keys(tmp_path / "keys")) as rig,
        TappedLine(rig.listen, flip) as line,
    ):
        rig.router()
        far = connect(load_rig(rig.configure("far.toml", line.port)), "recorder", PATIENCE)
        reader, items = SampleReader(far), list[object]()
        rig.publisher(BOOT)

        def came() -> bool:
            items.extend(reader.read(0.05))
            return changed == CHANGES and far.connected() and reader.silent_for() < 0.5

        eventually(came, "the link is made again after each change")
        blocks = [item for item in items if isinstance(item, SampleBlock)]
        assert blocks
        assert all(map(is_intact, blocks))
        assert not [item for item in items if isinstance(item, Gap)], "what was lost is fetched"
        reader.close()
        far.close()

"""A hostile client sends 200 kinds of message everywhere: nothing ends, nothing is changed."""

import time
from pathlib import Path

from tests.access.attack import attacked
from tests.access.rogue import ASKED, KINDS, NAMED, SAID, everything, kinds


def test_two_hundred_kinds_of_message_change_nothing(tmp_path: Path) -> None:
    payloads = kinds()
    assert len(set(payloads)) > 0.8 * KINDS
    messages = list(everything(payloads))
    assert len(messages) == KINDS * (len(SAID) + len(NAMED) + len(ASKED))
    with attacked(tmp_path) as rig:
        # Every seventh: all of them run in `python -m benchmarks rogue_client`.
        rig.attack(messages[::7], time.monotonic() + 60.0)
        rig.knock(10)
        found = rig.judge()
    assert found.ended == []
    assert found.samples > 0
    assert (found.wrong, found.lost, found.changes) == (0, 0, [])
    assert found.refused_connections >= found.connections == 10
    assert found.denied > 0
    assert found.refused > 0

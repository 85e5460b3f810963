"""The drawer over a feed, without a viewer: what it begins anew when a clock is set back."""

import threading
import time
from collections import deque
from dataclasses import replace

import pytest
import rerun as rr

from rigwatch.dashboard import drawer as drawing
from rigwatch.dashboard.board import Facts
from rigwatch.dashboard.drawer import Drawer
from rigwatch.wire.bus import ShelvedAlarm
from rigwatch.wire.messages import Alarm, Message, SampleBlock
from tests.dashboard.rig_messages import Rig
from tests.waiting import eventually

HOUR_NS = 3600 * 10**9


class Waiting:
    """A feed whose messages a test puts there."""

    skipped = lost_alarms = 0

    def __init__(self, standing: list[Alarm]) -> None:
        self.messages: deque[Message] = deque()
        self._standing = standing

    def drain(self) -> list[Message]:
        return [self.messages.popleft() for _ in range(len(self.messages))]

    def standing(self) -> list[Alarm]:
        return self._standing

    def shelf(self) -> list[ShelvedAlarm]:
        return []


@pytest.fixture
def recordings(monkeypatch: pytest.MonkeyPatch) -> list[rr.RecordingStream]:
    """The recordings that are begun; nothing of them is sent."""
    begun: list[rr.RecordingStream] = []

    class Unsent(rr.RecordingStream):
        def connect_grpc(self, *_: object, **__: object) -> None:
            begun.append(self)

        def flush(self, *_: object, **__: object) -> None: ...

    monkeypatch.setattr(rr, "RecordingStream", Unsent)
    monkeypatch.setattr(drawing, "LEAST", 0.0)
    return begun


def test_stamps_that_come_back_are_drawn_in_a_new_recording_and_the_words_go_on(
    recordings: list[rr.RecordingStream], monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[int] = []
    monkeypatch.setattr(drawing.Dashboard, "_say", lambda self: said.append(self.now_ns))
    rig = Rig(start_ns=time.time_ns())
    alarm = rig.alarm("dry_friction", "unacknowledged", 1, "dry friction")
    feed = Waiting([replace(alarm, t_ns=2**62)])
    blocks = [one for one in rig.messages(20.0) if isinstance(one, SampleBlock)]
    half = len(blocks) // 2
    drawer = Drawer(feed, "", Facts("rig"), 100.0)  # type: ignore[arg-type]
    seen = threading.Event()
    try:
        for block in blocks[:half]:
            feed.messages.append(replace(block, t_ns=block.t_ns + HOUR_NS))
        eventually(lambda: drawer.facts.samples >= sum(map(len, blocks[:half])), "those ahead")
        assert len(recordings) == 1
        for block in blocks[half:]:
            feed.messages.append(block)
            seen.wait(0.002)
        eventually(lambda: drawer.facts.samples == sum(map(len, blocks)), "those after")
        eventually(lambda: len(recordings) == 2, "another recording")
        eventually(lambda: bool(said) and said[-1] < blocks[-1].t_ns[-1] + HOUR_NS // 2, "words")
    finally:
        drawer.stop()
    assert drawer.failure is None
    assert len(recordings) == 2

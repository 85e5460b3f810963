"""Questions to every queryable of a rig, ordinary and hostile, and how long each takes."""

import time
from collections.abc import Iterator
from pathlib import Path

import msgspec

from rigwatch.recorder.past.pages import Bookmark, Question
from rigwatch.wire.bus import (
    DEVICE_KEY,
    DEVICE_RUN_KEY,
    KEY,
    Bus,
    DeviceRequest,
    ModelRequest,
)
from rigwatch.wire.bus.commands.command_check import signed
from rigwatch.wire.bus.commands.shelf import SHELF_KEY
from rigwatch.wire.messages import PAST_KEY, RING_KEY, TOPICS
from rigwatch.wire.ordering import Ask
from tests.access.rogue import BOOT, kinds
from tests.bus.publisher import OTHER

RINGS = [topic.name for topic in TOPICS if topic.numbered]
KEYS = (
    KEY, "monitor/standing", "monitor/receiver", SHELF_KEY, RING_KEY, PAST_KEY, "source/*",
    DEVICE_KEY, DEVICE_RUN_KEY, "said/*/*",
    *(f"ring/{process}/{name}" for process in ("monitor", "witness") for name in RINGS),
)  # fmt: skip
EVER = tuple(topic.name for topic in TOPICS), 0, 2**62


Asked = bytes | ModelRequest | DeviceRequest


def questions(key: str, model: Path) -> Iterator[Asked]:
    """An ordinary question, then hostile ones; models and devices are asked for by an operator."""
    if key == KEY:
        for text in (model.read_text(), "a = " + "[" * 50_000, f"noise = {'9' * 5000}"):
            yield ModelRequest("promote", text, "ann", "again")
    elif key == DEVICE_KEY:
        for identity in (OTHER, "x" * 100_000):
            yield DeviceRequest(identity, "ann", "again")
    elif key == PAST_KEY:
        yield Question(*EVER).to_bytes()
        yield Question(*EVER, Bookmark("../../etc/passwd", 2**62, 2**62), "eve").to_bytes()
    else:
        yield Ask(BOOT, 0, 64).to_bytes()
    yield from kinds()[::6]


def asked(bus: Bus, key: str, question: Asked) -> tuple[float, list[bytes]]:
    """Time until all that serve a key have answered or refused, at most a second [s]; answers."""
    if isinstance(question, ModelRequest):
        question = msgspec.json.encode(signed(bus, question))
    elif isinstance(question, DeviceRequest):
        question = msgspec.json.encode(signed(bus, question, DEVICE_RUN_KEY))
    began = time.monotonic()
    answers = bus.query(key, question, timeout=1.0)
    return time.monotonic() - began, answers

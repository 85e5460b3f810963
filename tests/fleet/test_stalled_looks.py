"""A page is told that its figures are old while the looks behind it stall, and when they go on."""

import asyncio
import contextlib
import threading
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

import msgspec
import pytest

from rigwatch.browser.rig import RigLink, link
from rigwatch.browser.server import event_streams, fleet_pages, list_routes, rig_routes
from rigwatch.browser.server.context import Context
from rigwatch.browser.server.fleet_pages import FleetPages
from rigwatch.browser.server.places import Places
from rigwatch.fleet import RigState
from rigwatch.wire.errors import BusError
from tests.bus.rig import TestRig
from tests.waiting import PATIENCE

OLD_AFTER = 0.4
Events = AsyncGenerator[bytes, None]
Opened = Callable[[Path], AbstractAsyncContextManager[Events]]


class Gate:
    """What a look has to pass, which may keep it waiting."""

    def __init__(self) -> None:
        self.open = threading.Event()
        self.open.set()

    def passed(self, *_: object, **__: object) -> None:
        assert self.open.wait(PATIENCE)


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Gate:
    made = Gate()
    monkeypatch.setattr(event_streams, "OLD_AFTER", OLD_AFTER)
    monkeypatch.setattr(fleet_pages, "BETWEEN", 0.05)
    monkeypatch.setattr(fleet_pages, "STILL_EVERY", 0.1)
    monkeypatch.setattr(list_routes, "EVERY", 0.05)
    monkeypatch.setattr(link, "TIMEOUT", 0.05)
    return made


def fleet(gate: Gate, _: pytest.MonkeyPatch) -> Opened:
    def look() -> list[RigState]:
        gate.passed()
        return [RigState("left", "left.toml", 0, "running")]

    @asynccontextmanager
    async def opened(_: Path) -> AsyncIterator[Events]:
        pages = FleetPages(look)
        following = asyncio.create_task(pages.follow())
        try:
            yield pages.events()
        finally:
            gate.open.set()
            following.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await following
            pages.dashboards.close()

    return opened


def studies(gate: Gate, monkeypatch: pytest.MonkeyPatch) -> Opened:
    found = list_routes.study_folders

    def through_the_gate(root: Path) -> object:
        gate.passed()
        return found(root)

    monkeypatch.setattr(list_routes, "study_folders", through_the_gate)

    @asynccontextmanager
    async def opened(folder: Path) -> AsyncIterator[Events]:
        yield list_routes._events(Context(Places(folder)))

    return opened


def rig(gate: Gate, monkeypatch: pytest.MonkeyPatch) -> Opened:
    def connect(*_: object) -> None:
        gate.passed()
        raise BusError("no router answers")

    monkeypatch.setattr(link, "connect", connect)

    @asynccontextmanager
    async def opened(folder: Path) -> AsyncIterator[Events]:
        made = RigLink(TestRig(folder).path)
        try:
            yield rig_routes._events(made)
        finally:
            gate.open.set()
            made.close()

    return opened


async def told(events: Events, *kinds: str) -> tuple[str, object]:
    """Kind and content of the next event of these kinds."""
    async with asyncio.timeout(PATIENCE):
        async for text in events:
            kind, _, data = text.decode().removeprefix("event: ").partition("\ndata: ")
            if kind in kinds:
                return kind, msgspec.json.decode(data)
    raise AssertionError(kinds)


@pytest.mark.parametrize(
    ("page", "news"), [(fleet, "rigs"), (studies, "jobs"), (rig, "status")], ids=lambda one: one
)
def test_figures_are_told_old_while_looks_stall_and_come_back_with_the_next_look(
    page: Callable[[Gate, pytest.MonkeyPatch], Opened],
    news: str,
    gate: Gate,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    opened = page(gate, monkeypatch)

    async def watched() -> None:
        async with opened(tmp_path) as events:
            first = await told(events, news, "old")
            assert first[0] == news
            gate.open.clear()
            _, content = await told(events, "old")
            assert isinstance(content, dict)
            assert content["seconds"] < PATIENCE
            gate.open.set()
            await told(events, news)  # nothing has changed, but it is new
            await events.aclose()

    asyncio.run(watched())

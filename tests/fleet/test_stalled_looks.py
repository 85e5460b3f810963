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
from tests.waiting import PATIENCE, eventually

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


def test_a_look_at_the_rigs_that_fails_unexpectedly_is_told_once_and_the_next_one_made(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(event_streams, "OLD_AFTER", 0.1)
    monkeypatch.setattr(fleet_pages, "BETWEEN", 0.02)
    monkeypatch.setattr(fleet_pages, "STILL_EVERY", 0.05)
    fails = threading.Event()
    fails.set()

    def look() -> list[RigState]:
        if fails.is_set():
            raise KeyError("left")
        return [RigState("left", "left.toml", 0, "running")]

    async def watched() -> None:
        pages = FleetPages(look)
        following = asyncio.create_task(pages.follow())
        events = pages.events()
        _, content = await told(events, "old")
        assert isinstance(content, dict)
        assert content["why"] == "the look at the rigs failed: KeyError: 'left'"
        fails.clear()
        while "rigs: 0 need" not in str(await told(events, "rigs")):
            pass
        await events.aclose()
        following.cancel()
        pages.dashboards.close()

    asyncio.run(watched())
    assert [one.getMessage() for one in caplog.records].count(
        "the look at the rigs failed: KeyError: 'left'; it begins anew"
    ) == 1


def test_a_link_that_fails_unexpectedly_is_told_once_and_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    class Broken:
        """A bus whose messages nobody foresaw."""

        def subscribe(self, *_: object) -> None:
            raise TypeError("no such message")

        def close(self) -> None:
            """Nothing to close."""

    made: list[object] = []

    def connect(*_: object) -> object:
        made.append(None)
        if len(made) > 3:
            raise BusError("no router answers")
        return Broken()

    monkeypatch.setattr(link, "TIMEOUT", 0.05)
    monkeypatch.setattr(link, "connect", connect)
    found = RigLink(TestRig(tmp_path).path)
    seen: set[object] = set()

    def went_on() -> bool:
        seen.add(found.status()["trouble"])
        return "no router answers" in seen

    eventually(went_on, "the link is made anew")
    found.close()
    failed = "the page's link to the rig failed: TypeError: no such message"
    assert failed in seen
    logged = [one.getMessage() for one in caplog.records]
    assert logged.count(f"{failed}; it begins anew") == 1

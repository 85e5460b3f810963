"""A page of many rigs is told that its figures are old while the server's looks stall."""

import asyncio
import contextlib
import threading
from collections.abc import AsyncGenerator

import msgspec

from rigwatch.browser.server.fleet_pages import OLD_AFTER, STILL_EVERY, FleetPages
from rigwatch.fleet import RigState


async def told(events: AsyncGenerator[bytes, None], kind: bytes) -> dict[str, object]:
    """Content of the next event of a kind."""
    async with asyncio.timeout(OLD_AFTER + 3 * STILL_EVERY):
        async for text in events:
            if text.startswith(b"event: " + kind + b"\n"):
                found: dict[str, object] = msgspec.json.decode(text.partition(b"data: ")[2])
                return found
    raise AssertionError(kind)


def test_figures_are_told_old_while_looks_stall_and_come_back_with_the_next_look() -> None:
    goes_on = threading.Event()
    goes_on.set()

    def look() -> list[RigState]:
        goes_on.wait()
        return [RigState("left", "left.toml", 0, "running")]

    async def watched() -> None:
        pages = FleetPages(look)
        following = asyncio.create_task(pages.follow())
        events = pages.events()
        try:
            while "1 rigs" not in str((await told(events, b"rigs"))["summary"]):
                pass
            goes_on.clear()
            old = await told(events, b"old")
            assert OLD_AFTER <= float(str(old["seconds"])) < OLD_AFTER + 2 * STILL_EVERY
            goes_on.set()
            again = await told(events, b"rigs")  # nothing has changed, but it is new
            assert again["summary"] == "1 rigs: 0 not well, 0 alarms"
        finally:
            goes_on.set()
            following.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await following
            pages.dashboards.close()

    asyncio.run(watched())

"""Kills of processes: every sample is delivered or reported as lost.

    plant ─pty─▶ daq ─▶ router ─▶ two readers, each with a ledger on disk
                                └▶ recorder ─▶ session

Readers and recorder are killed (SIGKILL) in turn and restarted, the router twice. Every sample up
to the newest one received anywhere must then be in each ledger and in the recording, delivered or
reported as lost. The last moments of the run are not counted.
"""

import itertools
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.processes.live_rig import LiveRig, live_rig
from tools.benchmark_table import Row

if TYPE_CHECKING:
    from rigwatch.wire.messages.message_types import Gap, SampleBlock

READERS = ("reader-1", "reader-2")
END_OF_RUN = 512
"""Allowed difference between the ends of two ledgers, as processes are ended one by one."""
Spans = dict[int, list[tuple[int, int, bool]]]
"""By boot: first and last number of each stretch, and whether it was reported lost."""


def run(quick: bool) -> list[Row]:
    """30 s, or ten minutes, of killing."""
    with live_rig(needs_model=False) as rig:
        kills = disturb(rig, 30.0 if quick else 600.0)
        ledgers = {name: read_ledger(rig.folder / f"{name}.log") for name in READERS}
        ledgers["recording"] = read_recording(rig)
    newest = {
        boot: max(end(spans[boot]) for spans in ledgers.values() if boot in spans)
        for boot in set().union(*ledgers.values())
    }
    return [row(name, spans, newest, kills) for name, spans in ledgers.items()]


def end(spans: list[tuple[int, int, bool]]) -> int:
    """The newest number in the stretches."""
    return max(last for _, last, _ in spans)


def row(name: str, spans: Spans, newest: dict[int, int], kills: dict[str, int]) -> Row:
    """The table's row of one ledger, given the newest sample of each boot that any ledger has."""
    total = sum(last - first + 1 for boot in spans.values() for first, last, _ in boot)
    lost = sum(last - first + 1 for boot in spans.values() for first, last, gone in boot if gone)
    found = [faults(stretches) for stretches in spans.values()]
    unreported, twice = (sum(fault[k] for fault in found) for k in (0, 1))
    unreported += sum(
        max(0, last - END_OF_RUN - (end(spans[boot]) if boot in spans else -1))
        for boot, last in newest.items()
    )
    return Row(
        f"samples of {total / 256:.0f} s unaccounted for, {name}",
        f"{unreported} unreported",
        "0 unreported",
        "",
        f"{total} samples, {lost} reported lost, {twice} kept twice; "
        f"killed {kills[name]} times, the router {kills['router']} times",
        passed=unreported == 0 and total > 0,
    )


def faults(spans: list[tuple[int, int, bool]]) -> tuple[int, int]:
    """Numbers between the first and the last that are missing, and numbers present twice."""
    missing = twice = 0
    following = min(first for first, _, _ in spans)
    for first, last, _ in sorted(spans):
        missing += max(0, first - following)
        twice += max(0, min(last + 1, following) - first)
        following = max(following, last + 1)
    return missing, twice


def disturb(rig: LiveRig, seconds: float) -> dict[str, int]:
    """Run the rig, kill one process after another; how often each was killed."""
    victims = itertools.cycle(("reader-1", "recorder", "reader-2"))
    running = {"router": start(rig, "router")}
    rig.command("daq")
    running |= {name: start(rig, name) for name in (*READERS, "recorder")}
    rig.wait_for("daq", "recorder", *READERS)
    rig.command("plant")
    kills = dict.fromkeys(running, 0) | {"recording": 0}
    started = time.monotonic()
    for number, victim in enumerate(victims):
        if started + seconds - time.monotonic() < 4.0:
            break
        name = "router" if number in (2, 9) else victim
        time.sleep(1.5)
        running[name].kill()
        running[name].wait()
        time.sleep(0.5 + 0.25 * (number % 4))
        running[name] = start(rig, name)
        kills[name] += 1
    time.sleep(max(0.0, started + seconds - time.monotonic()) + 2.0)
    kills["recording"] = kills["recorder"]
    rig.close()
    return kills


def start(rig: LiveRig, name: str) -> "subprocess.Popen[bytes]":
    """One process of the rig by its name here."""
    if name in READERS:
        log = str(rig.folder / f"{name}.log")
        return rig.start("-m", "benchmarks.processes.losses", str(rig.path), name, log)
    return rig.command({"recorder": "record"}.get(name, name))


def read_ledger(path: Path) -> Spans:
    """The ledger of a reader, across its restarts."""
    spans: Spans = {}
    for line in path.read_text(encoding="utf-8").splitlines(keepends=True):
        if line.endswith("\n"):
            kind, boot, first, last = line.split()
            if int(last) >= int(first):
                spans.setdefault(int(boot), []).append((int(first), int(last), kind == "lost"))
    return spans


def read_recording(rig: LiveRig) -> Spans:
    """The samples recorded, and those reported lost."""
    from rigwatch.wire.messages.message_types import Gap, SampleBlock
    from rigwatch.wire.session.reader import open_session

    spans: Spans = {}
    for folder in sorted((rig.folder / "sessions").glob("*Z*")):
        for recorded in open_session(folder).messages(["samples", "gaps"]):
            item = recorded.message
            if isinstance(item, SampleBlock):
                last = item.seq + len(item) - 1
                spans.setdefault(item.boot, []).append((item.seq, last, False))
            elif isinstance(item, Gap) and item.reporter == "recorder" and item.last >= item.first:
                spans.setdefault(item.boot, []).append((item.first, item.last, True))
    return spans


def reader(config: str, name: str, log: str) -> None:
    """A reader that writes a ledger and continues it after a kill."""
    from rigwatch.wire.bus.connection import connect
    from rigwatch.wire.delivery.sample_reader import SampleReader
    from rigwatch.wire.messages.message_types import Event
    from rigwatch.wire.rig_config import load_rig

    file = os.open(log, os.O_RDWR | os.O_CREAT | os.O_APPEND)
    samples = SampleReader(connect(load_rig(config), name), resume_after=_position(file))
    while True:
        items = [item for item in samples.read(0.2) if not isinstance(item, Event)]
        if items:
            os.write(file, "".join(_lines(items)).encode())


def _position(file: int) -> tuple[int, int] | None:
    """The last complete entry; an incomplete one is removed."""
    text = os.pread(file, os.fstat(file).st_size, 0)
    whole = text[: text.rfind(b"\n") + 1]
    os.ftruncate(file, len(whole))
    if not whole:
        return None
    _, boot, _, last = whole.splitlines()[-1].split()
    return int(boot), int(last)


def _lines(items: list["SampleBlock | Gap"]) -> Iterator[str]:
    from rigwatch.wire.messages.message_types import Gap

    for item in items:
        if isinstance(item, Gap):
            yield f"lost {item.boot} {item.first} {item.last}\n"
        else:
            yield f"here {item.boot} {item.seq} {item.seq + len(item) - 1}\n"


if __name__ == "__main__":
    reader(*sys.argv[1:])

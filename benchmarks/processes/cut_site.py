"""A site is cut off from its headquarters, which afterwards has recorded all the same.

    plant ─pty─▶ daq, monitor, recorder ─▶ router of the site ─▶ proxy ─▶ router, recorder
                                                                 killed   of the headquarters

The rig is the demonstration's, judged by its monitor. For the time of the cut there is no proxy.
Every sample and estimate, alarm and event of the site's recording must be in that of the
headquarters, once and with the same bits. `python -m benchmarks.processes.cut_site SECONDS` cuts
for another time.
"""

import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.archives.recordings import MODEL
from benchmarks.processes.live_rig import LiveRig, live_rig
from rigwatch.recorder import last_block
from rigwatch.wire.bus import Subscription, connect
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    EVENTS,
    HEALTH,
    SAMPLES,
    Block,
    Health,
    columns_of,
    encode,
)
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import Session, open_session
from tests.bus.rig import answers, free_port
from tests.waiting import eventually
from tools.benchmark_table import Row, as_text

Counters = Mapping[str, float]
BEFORE, AFTER = 2560, 5.0
"""Samples before the cut, and time after all has been filled in [s]."""
RINGS = 300.0
"""Shorter cuts than this the rings would bridge by themselves [s]."""
LONGEST = 300.0
"""Longest wait for what was missed [s]."""


@dataclass(frozen=True, slots=True)
class Figures:
    """Of the headquarters' recorder.

    Attributes:
        filled: samples, estimates and other messages from the site's recordings.
        took: time from the end of the cut until they were there [s].
    """

    filled: dict[str, float]
    took: float


def run(quick: bool) -> list[Row]:
    """30 s, or ten minutes, of a cut."""
    return [row(30.0 if quick else 600.0)]


def row(seconds: float) -> Row:
    """The row of a cut of so many seconds."""
    with live_rig(needs_model=False) as rig:
        found = cut(rig, seconds)
        own, far = (open_session(next((rig.folder / name).glob("*Z*"))) for name in ("own", "far"))
        counts = {line.name: differing(own, far, line.name) for line in (SAMPLES, ESTIMATES)}
        counts |= {line.name: plain(own, far, line.name) for line in (ALARMS, EVENTS, HEALTH)}
    wrong = sum(missing + more for missing, more, _ in counts.values())
    kinds = ", ".join(f"{total} {name}" for name, (_, _, total) in counts.items())
    filled = ", ".join(f"{count:.0f} {name}" for name, count in found.filled.items())
    return Row(
        f"site cut off for {seconds:.0f} s: missing, twice or different afterwards",
        f"{wrong} of {kinds}",
        "nothing",
        "",
        f"from the site's recordings {filled}; complete {found.took:.0f} s after the cut",
        passed=wrong == 0,
    )


def cut(rig: LiveRig, seconds: float) -> Figures:
    """Run both sites, cut the link for so long, and wait until all is filled in."""
    far, port, target = headquarters(rig, small=seconds < RINGS)
    for name in ("router", "daq", "monitor", "record"):
        rig.command(name)
    proxy = start_proxy(rig, port, target)
    rig.start("-m", "rigwatch", "router", str(far))
    recorder = rig.start("-m", "rigwatch", "record", str(far))
    rig.wait_for("daq", "monitor", "recorder", "headquarters")
    rig.command("plant")
    bus = connect(load_rig(far), "benchmark", 60.0)
    health = bus.subscribe(HEALTH)
    figures(health, lambda counters: counters["samples"] >= BEFORE)
    proxy.kill()
    proxy.wait()
    time.sleep(seconds)
    start_proxy(rig, port, target)
    mended = time.monotonic()
    names = [f"filled_{name}" for name in ("samples", "estimates", "messages")]
    counters = figures(health, lambda c: all(c[name] for name in names) and not c["filling"])
    bus.close()
    eventually(lambda: up_to_date(rig.folder / "far"), "the estimates are those of now")
    took = time.monotonic() - mended
    time.sleep(AFTER)
    recorder.send_signal(signal.SIGTERM)
    recorder.wait(60.0)
    time.sleep(AFTER)
    rig.close()
    return Figures({name.removeprefix("filled_"): counters[name] for name in names}, took)


def headquarters(rig: LiveRig, *, small: bool) -> tuple[Path, int, int]:
    """Its configuration, the port of the proxy, and that of the site's router.

    Args:
        rig: of the site.
        small: whether rings hold some seconds only, as a short cut would need nothing else.
    """
    text = re.sub(r'(?m)^model = ".*"', f'model = "{MODEL}"', rig.path.read_text())
    if small:
        text = text.replace("ring = 65536", "ring = 1024").replace(
            "megabytes = 32.0", "megabytes = 0.5"
        )
    target = int(re.findall(r"tcp/127\.0\.0\.1:(\d+)", text)[0])
    port, own = free_port(), free_port()
    link = f'links = ["tcp/127.0.0.1:{port}"]'
    path = rig.folder / "headquarters.toml"
    there = text.replace(f"127.0.0.1:{target}", f"127.0.0.1:{own}").replace("links = []", link, 1)
    there = there.replace("remote = false", "remote = true")
    path.write_text(recorded_in(there, rig.folder / "far"))
    rig.path.write_text(recorded_in(text, rig.folder / "own"))
    return path, port, target


def recorded_in(text: str, folder: Path) -> str:
    """A configuration with another folder of recordings."""
    head, tail = text.split("[recorder]\n", 1)
    own = re.sub(r"folder = .*", f'folder = "{folder}"', tail, count=1)
    return f"{head}[recorder]\n{own}"


def start_proxy(rig: LiveRig, port: int, target: int) -> "subprocess.Popen[bytes]":
    """A TCP proxy before the site's router."""
    proxy = rig.start("-m", "tests.bus.rig", str(port), str(target))
    eventually(lambda: answers(port), "the proxy")
    return proxy


def figures(heard: Subscription, wanted: Callable[[Counters], object]) -> Counters:
    """The figures of the headquarters' recorder once they are as wanted.

    Raises:
        TimeoutError: they are not within `LONGEST`.
    """
    deadline = time.monotonic() + LONGEST
    while time.monotonic() < deadline:
        health = heard.get(timeout=1.0)
        own = isinstance(health, Health) and health.source == "headquarters"
        if own and health.counters and wanted(health.counters):
            return dict(health.counters)
    raise TimeoutError("the headquarters' recorder does not get there")


def up_to_date(root: Path) -> bool:
    """Whether estimates are recorded as far as samples; the rings need a while to give theirs."""
    session = open_session(next(root.glob("*Z*")))
    ends = [last_block(session, line) for line in (SAMPLES, ESTIMATES)]
    samples, estimates = (int(block.t_ns[-1]) if block else 0 for block in ends)
    return estimates > samples - 2 * 10**9


def differing(own: Session, far: Session, kind: str) -> tuple[int, int, int]:
    """Samples that the far recording lacks, has besides or twice, and their number."""
    start, end = span(far)
    last = end if kind == SAMPLES.name else end - 2 * 10**9
    here, there = (Counter(rows(one, kind, start, last)) for one in (own, far))
    return (here - there).total(), (there - here).total(), here.total()


def rows(session: Session, kind: str, start: int, end: int) -> list[bytes]:
    """The bytes of each sample as it lies in the files."""
    found = []
    for item in session.messages([kind], start, end):
        block = item.message
        assert isinstance(block, Block)
        head = [np.full(len(block), block.boot), block.seq + np.arange(len(block)), block.t_ns]
        whole = np.stack([*head, *(c.values.view(np.int64) for c in columns_of(block))], axis=1)
        found += [row.tobytes() for row in whole]
    return found


def plain(own: Session, far: Session, kind: str) -> tuple[int, int, int]:
    """The same for messages, without those of the headquarters."""
    start, end = span(far)
    here, there = (
        Counter(
            encode(item.message)
            for item in one.messages([kind], start + 10**9, end - 10**9)
            if getattr(item.message, "source", "") != "headquarters"
        )
        for one in (own, far)
    )
    return (here - there).total(), (there - here).total(), here.total()


def span(session: Session) -> tuple[int, int]:
    """Times of the first and the last sample, the latter excluded [ns]."""
    blocks = list(session.samples())
    return int(blocks[0].t_ns[0]), int(blocks[-1].t_ns[-1]) + 1


if __name__ == "__main__":
    print(as_text([row(float(sys.argv[1]))]))

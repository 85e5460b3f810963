"""Two sites with linked routers: what the headquarters missed in a cut is in its recording.

source ─▶ router of the site ─▶ record            its own recording
                │ TCP proxy, killed
          router of the headquarters ─▶ record    must have the same
"""

import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.messages import ALARMS, EVENTS, HEALTH, Health, columns_of, encode
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from tests.bus.rig import CONFIG, TestRig, answers, free_port, kill
from tests.waiting import PATIENCE, eventually

pytestmark = [pytest.mark.xdist_group("sites"), pytest.mark.long]
RATE = 512.0
RING = '\n[recorder]\nfolder = "{}"\nsegment = 3.0\nflush = 0.1\nremote = {}\n'
SMALL = "ring_megabytes = 0.3\n"
"""Some seconds of estimates, as the ring of samples."""


class Sites:
    """A site with a source, and a headquarters whose link goes through a proxy."""

    def __init__(self, folder: Path, held: TestRig) -> None:
        self.site, self.folder = held, folder
        text = held.path.read_text().replace("[[channels]]", f"{SMALL}[[channels]]", 1)
        held.path.write_text(text.replace("[daq.device]", "[daq]\nring = 2048\n[daq.device]"))
        held.path.write_text(held.path.read_text() + RING.format(folder / "site", "false"))
        held.router()
        self.proxy, self.port = held.proxy()
        self.far = free_port()
        self.path = folder / "headquarters.toml"
        link = f'links = ["tcp/127.0.0.1:{self.port}"]\n[[channels]]'
        far = CONFIG.format(router=self.far, listen=self.far, lease=held.lease)
        far = far.replace("[[channels]]", link, 1) + RING.format(folder / "far", "true")
        self.path.write_text(far)
        held.start("-m", "rigwatch", "router", str(self.path))
        eventually(lambda: answers(self.far), "the headquarters' router listens")
        held.start("-m", "rigwatch", "record", str(held.path))
        self.site_records(0)
        self.start_far()
        self.health = held.bus("test", load_rig(self.path)).subscribe(HEALTH)
        self.figures: dict[str, float] = {}
        self.wait("samples", 0, -1)
        self.source = self.start_source(7)

    def start_far(self) -> None:
        self.recorder = self.site.start("-m", "rigwatch", "record", str(self.path))

    def start_source(self, boot: int):
        return self.site.start(
            "-m", "tests.sites.source", str(self.site.path), str(RATE), "--boot", str(boot)
        )

    def wait(self, name: str, least: float, beyond: float | None = None) -> float:
        """A figure of the headquarters' recorder, once it is above `beyond`, or so much more."""
        beyond = self.figures.get(name, 0.0) + least if beyond is None else beyond
        eventually(
            lambda: self._figure(name) > beyond, f"{name} of the headquarters above {beyond}"
        )
        return self.figures[name]

    def wait_filled(self) -> None:
        """The headquarters' recorder has asked for what it missed, and has every answer."""
        for name in ("filled_samples", "filled_estimates", "filled_messages"):
            self.wait(name, 0, 0)
        eventually(lambda: self._figure("filling") == 0.0, "all answers of the site's recordings")

    def _figure(self, name: str) -> float:
        for health in self.health.drain():
            if isinstance(health, Health) and health.source == "headquarters":
                self.figures = dict(health.counters)
        return self.figures.get(name, -2.0)

    def cut(self) -> None:
        kill(self.proxy)

    def site_records(self, samples: float) -> None:
        """The site goes on alone for so many samples."""
        bus = self.site.bus("onlooker").subscribe(HEALTH)
        seen: list[float] = []

        def there() -> bool:
            seen.extend(h.counters["samples"] for h in bus.drain() if h.source == "recorder")
            return bool(seen) and seen[-1] - seen[0] >= samples

        eventually(there, f"{samples} samples recorded at the site")

    def mend(self) -> None:
        self.proxy, _ = self.site.proxy(self.port)

    def end(self) -> tuple[Path, Path]:
        """Folders of both recordings, the headquarters' closed first."""
        self.recorder.send_signal(signal.SIGTERM)
        self.recorder.wait(PATIENCE)
        self.site_records(2 * RATE)
        (own,), (far,) = ((self.folder / name).glob("*Z*") for name in ("site", "far"))
        return own, far


@pytest.fixture
def sites(tmp_path: Path) -> Iterator[Sites]:
    with TestRig(tmp_path) as held:
        yield Sites(tmp_path, held)


def assert_same(own: Path, far: Path) -> None:
    """From its first to its last sample, the far recording has what the site's has, once."""
    here, there = open_session(own), open_session(far)
    start, end = span(there)
    for kind in ("samples", "estimates"):
        last = end if kind == "samples" else end - 1_000_000_000
        assert blocks(here, kind, start, last) == blocks(there, kind, start, last), kind
    for kind in (ALARMS, EVENTS, HEALTH):
        margin = 1_000_000_000
        mine, theirs = (
            plain(one, kind.name, start + margin, end - margin) for one in (here, there)
        )
        assert mine == theirs, kind.name
        assert mine


def span(session) -> tuple[int, int]:
    times = [block.t_ns for block in session.samples()]
    return int(times[0][0]), int(times[-1][-1]) + 1


def blocks(session, kind: str, start: int, end: int) -> list[tuple[object, ...]]:
    """Every sample as it lies in the files, in their order: (boot, seq, time, values)."""
    found: list[tuple[object, ...]] = []
    for item in session.messages([kind], start, end):
        message = item.message
        values = np.array([column.values for column in columns_of(message)]).T
        found += [
            (message.boot, message.seq + at, int(message.t_ns[at]), values[at].tobytes())
            for at in range(len(message))
        ]
    return found


def plain(session, kind: str, start: int, end: int) -> list[bytes]:
    """The messages of all but the headquarters, in the order of their times."""
    found = [item.message for item in session.messages([kind], start, end)]
    site = [m for m in found if getattr(m, "source", "") != "headquarters"]
    return [encode(m) for m in sorted(site, key=lambda m: (m.t_ns, encode(m)))]


def test_what_was_missed_in_a_cut_comes_from_the_sites_recordings(sites: Sites) -> None:
    sites.wait("samples", 2 * RATE)
    sites.cut()
    sites.site_records(10 * RATE)
    sites.mend()
    sites.wait_filled()
    sites.wait("samples", 2 * RATE)
    assert_same(*sites.end())


@pytest.mark.nightly
def test_source_and_headquarters_start_anew_in_the_cut(sites: Sites) -> None:
    sites.wait("samples", RATE)
    sites.cut()
    for boot in (8, 9):
        kill(sites.source)
        sites.source = sites.start_source(boot)
        sites.site_records(3 * RATE)
    kill(sites.recorder)
    sites.site_records(3 * RATE)
    sites.mend()
    sites.figures = {}
    sites.start_far()
    sites.wait("samples", 7 * RATE)
    sites.wait_filled()
    sites.wait("samples", 2 * RATE)
    assert_same(*sites.end())

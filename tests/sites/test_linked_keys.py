"""Linked routers have one authority, and without keys none links to a foreign address."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.wire.bus import Bus, Subscription, open_router
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import EVENTS, HEALTH, SAMPLES, Event
from rigwatch.wire.rig_config import load_rig
from tests.access.secured_rig import SecuredRig, make_keys
from tests.bus.rig import TestRig, answers, free_port
from tests.bus.samples import block
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("sites")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SecuredRig]:
    folder = tmp_path_factory.mktemp("site")
    with SecuredRig(folder, make_keys(folder / "keys")) as made:
        made.router()
        yield made


def linked(site: SecuredRig, folder: Path, keys: Path) -> Path:
    """The configuration of a router that is linked to the site's, with its router running."""
    port = free_port()
    text = site.path.read_text().replace(f"127.0.0.1:{site.listen}", f"127.0.0.1:{port}")
    link = f'links = ["tls/127.0.0.1:{site.listen}"]\n[bus.security]'
    path = folder / "far.toml"
    path.write_text(text.replace("[bus.security]", link, 1).replace(str(site.keys), str(keys)))
    site.start("-m", "rigwatch", "router", str(path))
    eventually(lambda: answers(port), "the linked router listens")
    return path


def passes(daq: Bus, reader: Bus) -> None:
    """Wait for a sample of `daq` at `reader`; any one may be dropped on a busy machine."""
    samples = reader.subscribe(SAMPLES)

    def told() -> bool:
        daq.publish(SAMPLES, block(0))
        return bool(samples.drain())

    eventually(told, "a sample")
    samples.close()


def is_refused(sender: Bus, reader: Bus) -> bool:
    """Whether markers of `sender` reach `reader` and samples sent before them do not."""
    samples, events = reader.subscribe(SAMPLES), reader.subscribe(EVENTS)
    found: list[object] = []
    marks: list[object] = []

    def told() -> bool:
        sender.publish(SAMPLES, block(0))
        sender.publish(EVENTS, Event("daq", 1, "info", "MARK", ""))
        marks.extend(events.drain())
        found.extend(samples.drain())
        # The subscriptions may become known between the first sample and its marker.
        return len(marks) >= 2

    eventually(told, "two markers")
    samples.close()
    events.close()
    return not found


def refused_connections(healths: Subscription) -> float:
    """The number that the site's router reports next."""
    found: list[float] = []

    def told() -> bool:
        routers = (one for one in healths.drain() if one.source == "router")
        found.extend(one.counters["refused_connections"] for one in routers)
        return bool(found)

    eventually(told, "the router's health")
    return found[-1]


def test_a_router_of_the_same_authority_passes_on_what_its_processes_may_say(
    site: SecuredRig, tmp_path: Path
) -> None:
    far = load_rig(linked(site, tmp_path, site.keys))
    reader = site.bus("reader", far)
    passes(site.bus("daq"), reader)
    # Its own router refuses the samples of one who is no daq.
    assert is_refused(site.bus("dashboard", far), site.bus("witness"))
    assert reader.tokens("alive/*")


def test_a_router_of_another_authority_is_not_linked(site: SecuredRig, tmp_path: Path) -> None:
    daq, reader = site.bus("daq"), site.bus("recorder")
    healths = reader.subscribe(HEALTH)
    before = refused_connections(healths)
    strange = load_rig(linked(site, tmp_path, make_keys(tmp_path / "strange")))
    lonely = site.bus("reader", strange).subscribe(SAMPLES)
    eventually(lambda: refused_connections(healths) > before + 2, "it is refused three times")
    passes(daq, reader)
    assert lonely.drain() == []


@pytest.mark.parametrize("endpoint", ["tcp/192.0.2.1:7447", "tls/192.0.2.1:7447"])
def test_no_foreign_address_is_linked_without_keys(tmp_path: Path, endpoint: str) -> None:
    rig = TestRig(tmp_path)
    text = rig.path.read_text().replace("lease", f'links = ["{endpoint}"]\nlease', 1)
    rig.path.write_text(text)
    with pytest.raises(
        ConfigError, match=r"bus\.links: found .* without keys, expected a loopback"
    ):
        open_router(load_rig(rig.path))

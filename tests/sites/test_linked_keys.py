"""Linked routers have one authority, and without keys none links to a foreign address."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.wire.bus import Bus, open_router
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import EVENTS, SAMPLES, Event
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


def heard(daq: Bus, reader: Bus) -> bool:
    """Whether a sample of `daq` reaches `reader`, told by a marker of another topic."""
    samples, events = reader.subscribe(SAMPLES), reader.subscribe(EVENTS)
    found: list[object] = []
    marks: list[object] = []

    def told() -> bool:
        daq.publish(SAMPLES, block(0))
        daq.publish(EVENTS, Event("daq", 1, "info", "MARK", ""))
        marks.extend(events.drain())
        found.extend(samples.drain())
        # The subscriptions may become known between the first sample and its marker.
        return len(marks) >= 2

    eventually(told, "two markers")
    samples.close()
    events.close()
    return bool(found)


def test_a_router_of_the_same_authority_passes_on_what_its_processes_may_say(
    site: SecuredRig, tmp_path: Path
) -> None:
    far = load_rig(linked(site, tmp_path, site.keys))
    daq, reader = site.bus("daq"), site.bus("reader", far)
    assert heard(daq, reader)
    # Its own router refuses the samples of one who is no daq.
    assert not heard(site.bus("dashboard", far), site.bus("witness"))
    assert reader.tokens("alive/*")


def test_a_router_of_another_authority_is_not_linked(site: SecuredRig, tmp_path: Path) -> None:
    strange = load_rig(linked(site, tmp_path, make_keys(tmp_path / "strange")))
    daq, reader = site.bus("daq"), site.bus("recorder")
    lonely = site.bus("reader", strange).subscribe(SAMPLES)
    for _ in range(3):
        assert heard(daq, reader)
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

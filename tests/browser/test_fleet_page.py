"""The live page of many rigs: it follows them by itself, in light and in dark, by keyboard."""

import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.wire.bus import serve_alarm_list
from rigwatch.wire.messages import HEALTH, Alarm, Health
from rigwatch.wire.rig_config import load_rig
from tests.browser.page import Page, Served, browser, looking
from tests.bus.rig import TestRig
from tests.fleet.test_fleet import alarm
from tests.monitor_process.test_several import rig_file

pytestmark = pytest.mark.xdist_group("browser")
ORDER = "return [...document.querySelectorAll('#fleet tbody a')].map((a) => a.textContent)"


class Rig:
    """A rig's daq and monitor as far as an onlooker sees them."""

    def __init__(self, base: TestRig, path: Path) -> None:
        config = load_rig(path)
        self.alarms: list[Alarm] = []
        self.daq, self.monitor = (base.bus(name, config) for name in ("daq", "monitor"))
        serve_alarm_list(self.monitor, lambda: self.alarms)

    def say(self) -> None:
        counters = {"lost_samples": 0.0, "latency_p99_ms": 7.5}
        self.monitor.publish(HEALTH, Health("monitor", 1, "running", "", counters))
        self.daq.publish(HEALTH, Health("daq", 1, "running", "", {}))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the rigs, each with a folder of its own."""
    return tmp_path_factory.mktemp("fleet")


@pytest.fixture(scope="module")
def rigs(folder: Path) -> Iterator[dict[str, Rig]]:
    with TestRig(folder) as base:
        base.router()
        paths = {name: rig_file(folder, name, base.listen) for name in ("left", "right")}
        found = {name: Rig(base, path) for name, path in paths.items()}
        rig_file(folder, "away")
        yield found


@pytest.fixture(scope="module")
def page(folder: Path, rigs: dict[str, Rig]) -> Iterator[Page]:
    paths = sorted(map(str, folder.glob("*/rig.toml")))
    assert len(paths) == len(rigs) + 1  # and one without a router
    served = Served(folder, command=("fleet", *paths, "--timeout", "1", "--serve"))
    try:
        with browser() as driver, looking(driver, served) as found:
            yield found
    finally:
        served.end()
    assert not [line for line in served.said if "Traceback" in line], "".join(served.said)


def until(page: Page, rigs: dict[str, Rig], order: list[str]) -> None:
    """The rigs stand in this order; their monitors go on meanwhile."""

    def there() -> bool:
        for rig in rigs.values():
            rig.say()
        return bool(page.run(ORDER) == order)

    page.until(there, f"the rigs as {order}")


def test_the_worst_rig_moves_up_by_itself_and_the_focus_stays(
    page: Page, rigs: dict[str, Rig]
) -> None:
    until(page, rigs, ["away", "left", "right"])
    assert "No alarm stands" in page.text("#alarms")
    page.run("document.getElementById('to-left').focus()")
    rigs["right"].alarms = [alarm("dry_friction", "error")]
    until(page, rigs, ["away", "right", "left"])
    assert page.run("return document.activeElement.id") == "to-left"
    assert "dry_friction" in page.text("#alarms")
    assert "<rubs> stop & look" in page.text("#rig-right")
    assert page.text("#summary") == "3 rigs: 2 need attention, 1 alarms"
    page.click("#alarm-right-dry_friction")
    assert page.run("return location.hash") == "#rig-right"
    rigs["right"].alarms = []
    until(page, rigs, ["away", "left", "right"])


@pytest.mark.parametrize("dark", [False, True])
def test_the_page_is_accessible_with_and_without_alarms(
    page: Page, rigs: dict[str, Rig], dark: bool
) -> None:
    for standing in ([], [alarm("dry_friction", "error"), alarm("wiring", "warning")]):
        rigs["left"].alarms = standing
        until(page, rigs, ["away", "left", "right"])
        page.until(lambda: ("wiring" in page.text("#alarms")) == bool(standing), "the alarms")  # noqa: B023
        assert page.violations(dark=dark) == []


def opened(page: Page, path: str) -> tuple[str, str]:
    """The address and the text of a page to which the served one leads."""
    head = {"authorization": page.served.bearer}
    with urllib.request.urlopen(
        urllib.request.Request(page.served.address + path, headers=head)
    ) as found:
        return found.url, found.read().decode()


def test_a_click_on_a_rig_opens_its_own_dashboard(page: Page, rigs: dict[str, Rig]) -> None:
    until(page, rigs, ["away", "left", "right"])
    link = "return document.getElementById('to-left')"
    assert page.run(f"{link}.pathname") == "/dashboard/left"
    assert page.run(f"{link}.target") == "_blank"
    first, text = opened(page, "/dashboard/left")
    assert not first.startswith(page.served.address)
    assert "rerun" in text.lower()
    assert opened(page, "/dashboard/left")[0] == first  # it goes on
    for rig, status in (("away", 503), ("nobody", 404)):
        with pytest.raises(urllib.error.HTTPError, match=str(status)) as refused:
            opened(page, f"/dashboard/{rig}")
        assert refused.value.read().decode().count("\n") == 1


def test_without_the_token_nobody_sees_the_rigs(page: Page) -> None:
    for path in ("/", "/events", "/dashboard/left"):
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(page.served.address + path)


@pytest.mark.nightly
def test_a_page_whose_server_ends_says_that_it_is_old(page: Page) -> None:
    page.served.end()
    page.until(lambda: "not connected since" in page.text("#link"), "the lost connection")
    assert page.text("#fleet")
    page.errors()  # the console's remarks on the lost connection

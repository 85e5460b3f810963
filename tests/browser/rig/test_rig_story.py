"""A hidden effect in the simulated rig, in the browser: from the alarm to the promoted model."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rigwatch.browser.rig.live_view import LiveView
from rigwatch.browser.rig.promotions import can_roll_back, promotions
from rigwatch.wire.messages import MOST_SOURCES, STRUCTURE_DAMAGE, Health
from tests.browser.page import Page, browser, looking, serving
from tests.bus.rig import ROOT
from tests.bus.test_complete_subscription import alarm
from tests.workbench.rigs.test_rig_story import Shell, Watched

ALARM = '[data-alarm="dry_friction"]'


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = Shell(tmp_path)
    (tmp_path / "story").mkdir()
    shutil.copy(ROOT / "tests" / "verify" / "model.toml", tmp_path / "story" / "model.toml")
    yield made
    made.close()


@pytest.fixture
def page(shell: Shell) -> Iterator[Page]:
    studies = shell.folder / "studies"
    studies.mkdir()
    arguments = ("--rig", str(shell.config))
    with (
        serving(studies, *arguments, cwd=shell.folder) as served,
        browser() as driver,
        looking(driver, served) as found,
    ):
        yield found


def residual(page: Page) -> float:
    """The monitor's residual over the last second, as the rig's page tells it [m/s^2]."""
    return float(page.data('[data-signal="residual"]') or "nan")


def settled(page: Page, watched: Watched) -> float:
    """The residual once the monitor watches again and the page says so."""
    watched.wait_until_armed()
    page.until(lambda: page.text("#link") == "watching", "the page tells it, too")
    page.until(lambda: residual(page) == pytest.approx(watched.residual(), rel=0.2), "its residual")
    return residual(page)


def seen(page: Page) -> None:
    """Nothing on the page is out of reach for anybody, in light and dark."""
    assert page.violations(dark=False) == []
    assert page.violations(dark=True) == []


@pytest.mark.nightly
def test_from_the_alarm_to_a_residual_that_falls(shell: Shell, page: Page) -> None:
    page.open("/rig")
    page.until(lambda: "no router answers" in page.text("#absent-why"), "the rig is absent")
    assert page.data("#link", "armed") == "absent"
    seen(page)
    shell.type("rigwatch up configs/story.toml &")
    watched = Watched(shell.config)
    try:
        page.until(lambda: "learns the healthy reference" in page.text("#link"), "not armed")
        page.until(lambda: page.text("#link") == "watching", "armed")
        page.until(lambda: page.all(ALARM), "the alarm")
        page.until(lambda: "coulomb@load" in page.text(f"{ALARM} .probable"), "its cause")
        page.pictured("browser-rig.png")
        page.click(f"{ALARM} [data-act=acknowledge]")
        page.until(lambda: page.data(ALARM, "state") == "acknowledged", "acknowledged")
        rubbing = settled(page, watched)
        page.click(f"{ALARM} [data-act=study]")
        page.until(lambda: "/study/" in page.driver.current_url, "the alarm as a study")
        page.until(lambda: page.data("#held-out"), "the study of the alarm, fitted")
        first = float(page.data("#held-out") or "nan")
        page.after(lambda: page.click("#explain"), "explain", "done")
        page.until(lambda: page.data("#ranking tbody tr", "effect") == "coulomb", "the ranking")
        assert page.data("#headline", "verdict") == "missing_effect"
        page.click('#ranking tr[data-label="coulomb@load"]')
        page.until(lambda: "coulomb" in page.text("#detail h3"), "the evidence")
        page.after(lambda: page.click('#detail [data-act="add"]'), "add", "done")
        page.until(lambda: float(page.data("#held-out") or "nan") < 0.2 * first, "the error falls")
        page.click("#tab-parameters")
        friction = float(page.data('[data-parameter="load_coulomb_Fc"]') or "nan")
        assert friction == pytest.approx(0.12, rel=0.1)
        page.after(lambda: page.click("[data-act=rehearse]"), "rehearse", "done")
        page.until(lambda: page.all("[data-act=promote]"), "what was rehearsed can go live")
        assert "residual" in page.text("#rehearsal")
        seen(page)
        page.after(lambda: page.click("[data-act=promote]"), "promote", "done")
        page.open("/rig")
        in_force = '#promotions [data-step="promote"][data-in-force="yes"]'
        page.until(lambda: "dry_friction" in page.text(in_force), "who promoted what, and when")
        assert settled(page, watched) < 0.7 * rubbing
        seen(page)
        page.pictured("browser-promoted.png")
        page.click("#rollback")
        page.until(lambda: page.all('#promotions [data-step="rollback"]'), "the previous model")
        assert settled(page, watched) == pytest.approx(rubbing, rel=0.3)
        page.until(lambda: page.all("#rollback") == [], "there is no model before it")
    finally:
        watched.close()


def test_why_the_monitor_does_not_watch() -> None:
    live = LiveView(256.0)
    assert "no samples arrive" in live.states(0.0, 3.0)["why"]
    live.take(Health("monitor", 0, "unsuitable", "the model needs a channel", {}), 0.0)
    live._heard["samples"] = 0.0
    assert live.states(1.0, 3.0)["why"] == "the model needs a channel"
    live._heard["samples"] = 5.0
    assert "no monitor runs" in live.states(5.0, 3.0)["why"], "what one that has gone said is old"
    live._heard["samples"] = 0.0
    live.take(Health("monitor", 0, "running", "", {}), 1.0)
    assert "no monitor runs" in live.states(1.0, 3.0)["why"]
    live._heard["estimates"], live._figures = 1.0, {"armed": 0.0}
    assert "about 3 s of steady drive" in live.states(1.0, 3.0)["why"]
    live._figures = {"armed": 1.0, "observable": 1.0}
    assert live.states(1.0, 3.0)["armed"]
    assert live.states(1.0, 3.0)["why"] == ""
    assert live.states(9.0, 3.0)["processes"][0]["state"] == "silent"


def test_a_slow_rig_is_not_silent_between_two_samples() -> None:
    live = LiveView(0.1)
    live._heard = {"samples": 0.0, "estimates": 0.0}
    live._figures = {"armed": 1.0, "observable": 1.0}
    assert live.hears(25.0)
    assert live.states(25.0, 3.0)["why"] == ""
    assert not live.hears(31.0)


def test_an_alarm_that_ended_while_the_link_was_down_does_not_stay() -> None:
    live, names = LiveView(256.0), ("dry_friction", "stale", STRUCTURE_DAMAGE)
    for name in names:
        live.take(replace(alarm(0), name=name, state="unacknowledged"), 0.0)

    def states() -> dict[str, str]:
        return {one["name"]: one["state"] for one in live.alarms()}

    listed = [replace(alarm(0), name="stale", state="unacknowledged")]
    live.standing(listed)
    live.only(listed)
    assert set(states().values()) == {"unacknowledged"}, "it may have been raised after the list"
    live.standing(listed)
    live.only(listed)
    assert states() == {
        "dry_friction": "normal", "stale": "unacknowledged", STRUCTURE_DAMAGE: "unacknowledged",
    }  # fmt: skip
    live.take(replace(alarm(1), name="dry_friction", state="unacknowledged"), 0.0)
    live.only(listed)
    assert states()["dry_friction"] == "unacknowledged"


def test_a_rig_without_promotions_has_an_empty_history(tmp_path: Path) -> None:
    shell = Shell(tmp_path)
    assert promotions(shell.config, tmp_path) == []
    assert not can_roll_back(shell.config)


def test_processes_that_are_made_up_are_bounded() -> None:
    live = LiveView(256.0)
    live.take(Health("monitor", 0, "running", "", {}), 0.0)
    for number in range(3 * MOST_SOURCES):
        live.take(Health(f"p{number}", 0, "running", "", {}), 0.0)
    live.take(Health("monitor", 1, "stale", "", {}), 1.0)
    found = {one["name"]: one["state"] for one in live.states(1.0, 3.0)["processes"]}
    assert len(found) == MOST_SOURCES
    assert found["monitor"] == "stale"

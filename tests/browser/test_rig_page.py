"""A hidden effect in the simulated rig, in the browser: from the alarm to the promoted model."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.browser.rig.live_view import LiveView
from rigwatch.browser.rig.promotions import can_roll_back, promotions
from rigwatch.wire.messages.message_types import Health
from tests.browser.page import Page, Served, browser
from tests.bus.rig import ROOT
from tests.workbench.rigs.test_rig_story import ENOUGH, Shell, Watched

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
    served = Served(studies, "--rig", str(shell.config), cwd=shell.folder)
    try:
        with browser() as driver:
            found = Page(driver, served)
            found.enter()
            yield found
            refused = [one for one in found.errors() if "/api/rig/study" not in one]
            assert refused == []
            assert found.requests() <= {served.address}
    finally:
        served.end()
    assert not [line for line in served.said if "Traceback" in line], "".join(served.said)


def opened_as_a_study(page: Page) -> bool:
    """Press the button, and again where the recording does not reach far enough yet."""
    if page.all(f"{ALARM} [data-act=study]:enabled"):
        refusal = page.text("#toast")
        assert not refusal or "expected at least" in refusal, refusal
        page.run("document.querySelector(arguments[0]).click()", f"{ALARM} [data-act=study]")
    return "/study/" in page.driver.current_url


def seen(page: Page) -> None:
    """Nothing on the page is out of reach for anybody, in light and dark."""
    assert page.violations(dark=False) == []
    assert page.violations(dark=True) == []


@pytest.mark.long
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
        watched.wait_for(ENOUGH)
        page.run("window.scrollTo(0, 0)")
        page.click(f"{ALARM} [data-act=acknowledge]")
        page.until(lambda: page.data(ALARM, "state") == "acknowledged", "acknowledged")
        seen(page)
        page.until(lambda: opened_as_a_study(page), "the alarm as a study")
        page.until(lambda: page.data("#held-out"), "the study of the alarm, fitted")
        first = float(page.data("#held-out") or "nan")
        page.after(lambda: page.press("e"), "explain", "done")
        page.until(lambda: page.data("#ranking tbody tr", "effect") == "coulomb", "the ranking")
        page.press("j")
        page.until(lambda: "coulomb" in page.text("#detail h3"), "the evidence")
        page.after(lambda: page.press("a"), "add", "done")
        page.until(lambda: float(page.data("#held-out") or "nan") < 0.2 * first, "the error falls")
        page.until(lambda: page.all("[data-act=rehearse]"), "what can be rehearsed")
        page.after(lambda: page.click("[data-act=rehearse]"), "rehearse", "done")
        page.until(lambda: page.all("[data-act=promote]"), "what was rehearsed can go live")
        assert "residual" in page.text("#rehearsal")
        seen(page)
        before = watched.residual()
        page.after(lambda: page.click("[data-act=promote]"), "promote", "done")
        watched.wait_until_armed()
        assert watched.residual() < 0.7 * before
        page.open("/rig")
        in_force = '#promotions [data-step="promote"][data-in-force="yes"]'
        page.until(lambda: "dry_friction" in page.text(in_force), "who promoted what, and when")
        page.until(lambda: page.text("#link") == "watching", "the page tells it, too")
        seen(page)
        page.pictured("browser-promoted.png")

        def back() -> bool:
            if not page.all('#promotions [data-step="rollback"]') and page.all("#rollback:enabled"):
                page.run("document.getElementById('rollback').click()")
            return bool(page.all('#promotions [data-step="rollback"]'))

        page.until(back, "the previous model")
        watched.wait_until_armed()
        assert watched.residual() == pytest.approx(before, rel=0.3)
    finally:
        watched.close()


def test_why_the_monitor_does_not_watch() -> None:
    live = LiveView(256.0)
    assert "no samples arrive" in live.states(0.0, 3.0)["why"]
    live.take(Health("monitor", 0, "unsuitable", "the model needs a channel", {}), 0.0)
    live._heard["samples"] = 0.0
    assert live.states(1.0, 3.0)["why"] == "the model needs a channel"
    live.take(Health("monitor", 0, "running", "", {}), 1.0)
    assert "no monitor runs" in live.states(1.0, 3.0)["why"]
    live._heard["estimates"], live._figures = 1.0, {"armed": 0.0}
    assert "about 3 s of steady drive" in live.states(1.0, 3.0)["why"]
    live._figures = {"armed": 1.0, "observable": 1.0}
    assert live.states(1.0, 3.0)["armed"]
    assert live.states(1.0, 3.0)["why"] == ""
    assert live.states(9.0, 3.0)["processes"][0]["state"] == "silent"


def test_a_rig_without_promotions_has_an_empty_history(tmp_path: Path) -> None:
    shell = Shell(tmp_path)
    assert promotions(shell.config, tmp_path) == []
    assert not can_roll_back(shell.config)

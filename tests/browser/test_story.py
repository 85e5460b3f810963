"""EMPS in the browser, from the files to 2.01 N and a refusal: by mouse, and by keyboard alone."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.select import Select

from rigwatch.commands import main
from rigwatch.workbench.study import FILE
from tests.browser.page import Page
from tests.workbench.conftest import measured

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("browser")]
STEPS = [("coulomb", 4.08), ("constant_force", 2.51), ("viscous_by_direction", 2.01)]
SPOKEN_AGAINST = "position_dependent"
FILES = {"emps": "DATA_EMPS.mat", "emps_pulses": "DATA_EMPS_PULSES.mat"}
Told = Callable[..., Any]


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Told:
    """What a command prints as JSON."""

    def run(*arguments: str) -> Any:
        capsys.readouterr()
        assert main([*arguments, "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    return run


def equal_to_the_commands(page: Page, study: Path, told: Told) -> None:
    """Every number of the page is that of the command line."""
    found = told("compare", str(study))
    for css, name in (("#held-out", "held_out_error"), ("#train", "train_error"),
                      ("#floor", "noise_floor")):  # fmt: skip
        assert float(page.data(css) or "nan") == pytest.approx(found[name], rel=1e-9)
    shown = page.run(
        "return [...document.querySelectorAll('[data-parameter]')]"
        ".map((one) => [one.dataset.parameter, Number(one.dataset.value)])"
    )
    assert dict(shown) == pytest.approx(
        {name: value["value"] for name, value in found["parameters"].items()}, rel=1e-9
    )


def held_out(page: Page) -> float:
    return float(page.data("#held-out") or "nan")


def test_the_story_by_mouse(page: Page, root: Path, told: Told) -> None:
    page.open("/")
    page.click("#new-study")
    for name, file in FILES.items():
        page.find("#file").send_keys(str(measured("emps", file)))
        page.until(lambda: page.all("#mapping:not([hidden])"), "a look at the file")
        assert page.find("#recording-name").get_property("value") == name
        page.click("#import")
        wanted = f"recordings/{name}.mcap"
        page.until(lambda w=wanted: page.run("return document.body.dataset.imported") == w, wanted)
    Select(page.find("#begin")).select_by_value("emps")
    page.until(lambda: page.text("#needs") == "model emps-force", "the template's parts")
    page.until(
        lambda: page.run("return document.querySelectorAll('#parts tbody tr').length") == 2, "parts"
    )
    page.click("#make")
    page.until(lambda: held_out(page) > 9, "the first fit")
    assert held_out(page) == pytest.approx(9.77, abs=0.02)
    page.until(lambda: page.run("return document.body.dataset.drawn"), "the signals")
    study = root / "emps"
    for effect, error in STEPS:
        page.after(lambda: page.click("#explain"), "explain", "done")
        row = f'#ranking tr[data-label="{effect}@load"]'
        page.until(lambda r=row: page.all(r), "the ranking")
        assert page.data("#headline", "verdict") == "missing_effect"
        assert page.data("#ranking tbody tr", "effect") == effect
        if effect == STEPS[-1][0]:
            before = (study / FILE).read_bytes()
            page.click(f'#ranking tr[data-label="{SPOKEN_AGAINST}@load"]')
            refused(page, SPOKEN_AGAINST, lambda: page.click('#detail [data-act="add"]'))
            assert (study / FILE).read_bytes() == before
        page.click(row)
        page.until(lambda e=effect: e.replace("_", " ") in page.text("#detail h3"), "the evidence")
        if effect == "constant_force":
            page.pictured("browser-study.png")
        page.after(lambda: page.click('#detail [data-act="add"]'), "add", "done")
        page.until(lambda e=error: held_out(page) == pytest.approx(e, abs=0.02), f"{error} N")
    equal_to_the_commands(page, study, told)
    lines = told("study", "show", str(study))["ledger"]
    assert [line["step"] for line in lines] == ["new", "add", "add", "refused", "add"]
    assert page.violations(dark=False) == []
    assert page.violations(dark=True) == []
    page.after(lambda: page.click("#undo"), "undo", "done")
    page.until(lambda: held_out(page) == pytest.approx(2.51, abs=0.02), "2.51 N again")


def refused(page: Page, effect: str, act: Callable[[], None]) -> None:
    """Add an effect that the recordings held out speak against; the page says so."""
    page.until(lambda: effect.replace("_", " ") in page.text("#detail h3"), "the evidence")
    page.after(act, "add", "refused")
    assert "not added" in page.text("#toast")


def step_to(page: Page, label: str) -> None:
    """Press j until a candidate is chosen."""
    for _ in page.all("#ranking tr.candidate"):
        page.press("j")
        if page.run("return document.activeElement.dataset.label") == label:
            return
    raise AssertionError(f"the key j does not come to {label}")


def tab_to(page: Page, css: str) -> None:
    """Press the tab key until an element has the focus."""
    for _ in range(120):
        if page.run("return document.activeElement.matches(arguments[0])", css):
            return
        page.press(Keys.TAB)
    raise AssertionError(f"the tab key does not come to {css}")


@pytest.mark.nightly
def test_the_story_by_keyboard_alone(page: Page, root: Path, told: Told) -> None:
    for name in FILES:
        (root / "recordings" / f"{name}.mcap").unlink(missing_ok=True)
    page.open("/")
    tab_to(page, "#new-study")
    page.press(Keys.ENTER)
    page.until(lambda: page.text("#needs").startswith("model"), "the page")
    for name, file in FILES.items():
        # The dialog of the machine's own files is none of the page's: it gets the file's name.
        tab_to(page, "#file")
        page.find("#file").send_keys(str(measured("emps", file)))
        there = f"return document.activeElement.value === '{name}'"
        page.until(lambda told=there: page.run(told), "the form has the focus")
        tab_to(page, "#import")
        page.press(Keys.ENTER)
        wanted = f"recordings/{name}.mcap"
        page.until(lambda w=wanted: page.run("return document.body.dataset.imported") == w, wanted)
    page.until(
        lambda: page.run("return document.querySelectorAll('#parts tbody tr').length") == 2, "parts"
    )
    tab_to(page, "#study-name")
    page.press("keys", Keys.TAB)
    page.press(Keys.HOME)
    page.until(lambda: page.text("#needs") == "model emps-force", "the template")
    tab_to(page, "#make")
    page.press(Keys.ENTER)
    page.until(lambda: held_out(page) > 9, "the first fit")
    for effect, error in STEPS:
        page.after(lambda: page.press("e"), "explain", "done")
        page.until(lambda e=effect: page.data("#ranking tbody tr", "effect") == e, effect)
        page.press("j")
        page.until(lambda e=effect: e.replace("_", " ") in page.text("#detail h3"), "the evidence")
        page.after(lambda: page.press("a"), "add", "done")
        page.until(lambda e=error: held_out(page) == pytest.approx(e, abs=0.02), f"{error} N")
    equal_to_the_commands(page, root / "keys", told)
    page.press("[")
    page.until(lambda: "step=2" in page.driver.current_url, "the step before")
    page.until(lambda: held_out(page) == pytest.approx(2.51, abs=0.02), "its error")
    page.press("]")
    page.until(lambda: held_out(page) == pytest.approx(2.01, abs=0.02), "as it is")
    page.after(lambda: page.press("u"), "undo", "done")
    page.until(lambda: held_out(page) == pytest.approx(2.51, abs=0.02), "2.51 N again")
    page.until(lambda: page.all(f'#ranking tr[data-label="{SPOKEN_AGAINST}@load"]'), "the ranking")
    step_to(page, f"{SPOKEN_AGAINST}@load")
    refused(page, SPOKEN_AGAINST, lambda: page.press("a"))

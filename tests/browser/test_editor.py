"""Own effects and models in the editor: the parser's messages at the place, a picture, saving."""

from pathlib import Path

import pytest
from selenium.webdriver.common.keys import Keys

from rigwatch.workbench.steps.change import learn_text
from rigwatch.workbench.study.ledger import lines
from rigwatch.workbench.study.study import Study, open_study
from tests.browser.page import Page
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

pytestmark = pytest.mark.xdist_group("browser")
NAME, FILE = "edited/study", "my_effects.toml"


@pytest.fixture(scope="module")
def study(served) -> Study:  # type: ignore[no-untyped-def]
    return studied(served.folder / "edited", WAVES, [waves(0)], [waves(1)], UNITS)


def checked(page: Page) -> int:
    return int(page.data("body", "checked") or 0)


def write(page: Page, text: str) -> None:
    """Replace the text, as a person who pastes does, and wait for its check."""
    before = checked(page)
    page.run(
        "const box = document.getElementById('text'); box.focus(); box.select();"
        "document.execCommand('insertText', false, arguments[0])",
        text,
    )
    page.until(lambda: checked(page) > before, "the check")


def opened(page: Page, kind: str) -> str:
    page.open(f"/edit/{kind}/{NAME}")
    page.until(lambda: checked(page) > 0, "the first check")
    return str(page.run("return document.getElementById('text').value"))


def test_a_slip_is_told_at_its_place_and_the_effect_is_drawn_and_saved(
    page: Page, study: Study
) -> None:
    text = opened(page, "effect").replace("k*v", "k*x").replace("{F}/({v})", "{F}/({x})")
    write(page, text)
    page.until(lambda: page.all("#figures svg"), "the picture of what is right")
    write(page, text.replace("k*x", "k*w"))
    line = text[: text.index("k*x")].count("\n") + 1
    assert page.data("#problems button", "line") == str(line)
    assert "unknown name 'w'" in page.text("#problems")
    assert page.text("#marks mark") == "w"
    assert not page.find("#save").is_enabled()
    page.pictured("browser-editor.png")
    assert page.violations(dark=False) == []
    assert page.violations(dark=True) == []
    page.click("#problems button")
    at = page.run("return document.getElementById('text').selectionStart")
    assert text.replace("k*x", "k*w")[at] == "w"
    write(page, text)
    page.until(lambda: len(page.all("#figures svg")) >= 2, "the force against x and against v")
    told = [one.text for one in page.all("#figures figcaption")]
    assert any("force against x" in words for words in told)
    assert any("force against v" in words for words in told)
    page.run("document.querySelector('#figures svg').focus()")
    page.press(Keys.ARROW_RIGHT)
    page.until(lambda: "force" in page.text("#live"), "the picture's first point is read")
    page.click("#save")
    page.until(lambda: page.text("#saved").startswith("saved"), "saved")
    now = open_study(study.folder)
    assert now.own == {"my_effect"}
    assert (study.folder / FILE).read_text() == text
    assert [one["step"] for one in lines(now)] == ["new", "effect-file"]


def test_a_file_that_was_changed_elsewhere_is_not_overwritten(page: Page, study: Study) -> None:
    if not (study.folder / FILE).exists():
        pytest.skip("the effect of the test before is not there")
    text = opened(page, "effect")
    other = text.replace("What happens", "Something else happens")
    learn_text(open_study(study.folder), FILE, other)
    write(page, text.replace("What happens", "My own words"))
    page.click("#save")
    page.until(lambda: "changed elsewhere" in page.text("#toast"), "the refusal")
    assert (study.folder / FILE).read_text() == other
    write(page, text)  # what is not saved would hold the page back
    assert all("409" in message for message in page.errors())


def test_a_models_findings_are_those_of_its_check(page: Page, study: Study) -> None:
    before = len(list(lines(open_study(study.folder))))
    text = opened(page, "model")
    write(page, text + '\n[parameters.idle]\nvalue = 1.0\nunit = "N"\n')
    assert page.data("#problems button", "line") == str(text.count("\n") + 2)
    assert "used in no equation" in page.text("#problems")
    better = text.replace('summary = "', 'summary = "Own: ', 1)
    write(page, better)
    page.click("#save")
    page.until(lambda: "now uses this model" in page.text("#saved"), "saved")
    now = open_study(study.folder)
    assert now.file.model == "model.toml"
    assert [one["step"] for one in list(lines(now))[before:]] == ["model-file"]


def test_an_own_model_is_offered_to_new_studies(page: Page, root: Path) -> None:
    page.open("/edit-model?like=mass-spring-damper")
    page.until(lambda: checked(page) > 0, "the first check")
    page.click("#save")
    page.until(lambda: "New study offers it" in page.text("#saved"), "saved")
    assert (root / "models" / "my-mass-spring-damper.toml").is_file()
    page.open("/new")
    page.find('#begin option[value="own:my-mass-spring-damper.toml"]')
    page.open("/edit-model?like=none")
    assert "no such model" in page.text("main")
    messages = page.errors()
    assert all("404" in message for message in messages), messages

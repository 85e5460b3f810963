"""What a study's page says and gives: states, figures as files, the same steps elsewhere."""

import ast
import inspect
import shlex
from functools import partial
from pathlib import Path

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

import rigwatch
from rigwatch.commands import main
from rigwatch.workbench.study.ledger import lines
from rigwatch.workbench.study.study import Study, open_study
from tests.browser.page import Page, Served
from tests.waiting import wait_until
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import recorded, studied

pytestmark = pytest.mark.xdist_group("browser")
NAME = "states/study"


@pytest.fixture(scope="module")
def study(served: Served) -> Study:
    return studied(served.folder / "states", WAVES, [waves(0)], [waves(1)], UNITS)


def opened(page: Page) -> None:
    page.open(f"/study/{NAME}")
    page.until(lambda: page.data("#held-out"), "the fit")
    page.until(lambda: page.data("body", "count"), "the signals")


@pytest.fixture
def downloads(page: Page, tmp_path: Path) -> Path:
    given = {"behavior": "allow", "downloadPath": str(tmp_path)}
    page.driver.execute_cdp_cmd("Browser.setDownloadBehavior", given)
    return tmp_path


def _saved(page: Page, css: str, file: Path) -> bool:
    """Press a button and wait for its file; Chromium drops downloads that follow too fast."""
    page.click(css)
    return wait_until(file.exists, 3.0)


def test_an_explained_study_gives_every_figure_as_picture_and_as_numbers(
    page: Page, study: Study, downloads: Path
) -> None:
    opened(page)
    page.after(lambda: page.press("e"), "explain", "done")
    page.until(lambda: page.all("#ranking tr.candidate"), "the ranking")
    page.press("j")
    page.until(lambda: page.text("#detail h3"), "the evidence")
    wanted = set[str]()
    for tab in ("missing", "where", "parameters"):
        page.click(f"#tab-{tab}")
        for figure in page.run(
            "return [...document.querySelectorAll(arguments[0])].map((one) => one.dataset.figure)",
            f"#{tab} figure[data-figure], #ledger figure[data-figure]",
        ):
            for button in ("SVG", "CSV"):
                css = f'figure[data-figure="{figure}"] .export [aria-label$="{button}"]'
                file = downloads / f"{figure}.{button.lower()}"
                page.until(partial(_saved, page, css, file), file.name)
                wanted.add(file.name)
    assert {"ranking.svg", "error-per-step.svg", "parameters.csv"} <= wanted
    for name in wanted:
        text = (downloads / name).read_text(encoding="utf-8")
        assert text.startswith("<svg") if name.endswith(".svg") else "," in text, name
        assert "var(--" not in text
    assert page.data("#held-out") in (downloads / "error-per-step.csv").read_text()
    # The signals' own, and the excitation of the next experiment or why there is none.
    page.run("document.getElementById('export-signals-csv').click()")
    page.until(lambda: any(p.name.startswith("signals-") for p in downloads.iterdir()), "signals")
    assert page.all("#experiment") or len(page.text("#no-experiment")) > 20


def test_the_numbers_of_a_chart_are_read_by_keyboard(page: Page, study: Study) -> None:
    opened(page)
    page.run("document.getElementById('signals').focus()")
    keys = ActionChains(page.driver).key_down(Keys.SHIFT).send_keys(Keys.ARROW_RIGHT)
    keys.key_up(Keys.SHIFT).perform()
    page.until(lambda: "measured" in page.text("#live"), "the first value")
    page.run("document.querySelector('details.menu').open = true")
    page.click("#numbers")
    page.until(lambda: len(page.all("#table tbody tr")) > 20, "the table")
    assert page.violations(dark=False) == []
    page.press(Keys.ESCAPE)


def test_commands_and_python_lines_do_what_the_page_does(
    page: Page, study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    opened(page)
    page.click("#tab-data")
    copied = page.run(
        "return [...document.querySelectorAll('table.copy [data-copy]')].map((b) => b.dataset.copy)"
    )
    shells = [text for text in copied if text.startswith("rigwatch ")]
    pythons = [text for text in copied if text.startswith("import rigwatch")]
    assert len(shells) == len(pythons) >= 8
    for text in pythons:
        call = ast.parse(text).body[1].value  # type: ignore[attr-defined]
        method = getattr(rigwatch.Study, call.func.attr)
        given = [ast.literal_eval(one) for one in call.args]
        named = {one.arg: ast.literal_eval(one.value) for one in call.keywords}
        inspect.signature(method).bind(None, *given, **named)
        assert Path(ast.literal_eval(call.func.value.args[0])) == study.folder.resolve()
    for text in shells:
        with pytest.raises(SystemExit) as ended:
            main([*shlex.split(text)[1:], "--help"])
        assert ended.value.code == 0
    compare = next(text for text in shells if " compare " in text)
    assert main([*shlex.split(compare)[1:], "--json"]) == 0
    said = capsys.readouterr().out
    assert str(page.data("#held-out")) in said


def test_cancelled_and_failed_are_told_and_stay_to_be_read(page: Page, study: Study) -> None:
    opened(page)
    before = {p: p.read_bytes() for p in study.folder.glob("*.*") if p.is_file()}
    page.run("delete document.body.dataset.ended")
    page.press("e")
    page.until(lambda: page.data("#job", "state") == "running", "running")
    page.press(Keys.ESCAPE)
    page.until(lambda: page.data("#job", "state") == "cancelled", "cancelled")
    assert "the study is as it was" in page.text("#job-text")
    assert {p: p.read_bytes() for p in study.folder.glob("*.*") if p.is_file()} == before
    page.click("#dismiss")
    page.until(lambda: page.all("#job[hidden]"), "dismissed")
    assert page.all("#undo:disabled"), "there is nothing to undo"
    page.press("u")
    page.until(lambda: page.data("#job", "state") == "failed", "failed")
    assert "found no effect to undo" in page.text("#job-text")


def test_what_is_refused_is_added_anyway_and_the_ledger_says_so(page: Page, study: Study) -> None:
    opened(page)
    page.after(lambda: page.press("e"), "explain", "done")
    page.until(lambda: page.all("#ranking tr.candidate"), "the ranking")
    label = page.run(
        "return [...document.querySelectorAll('#ranking tr.candidate:not([hidden])')].at(-1)"
        ".dataset.label"
    )
    page.click(f'#ranking tr[data-label="{label}"]')
    page.until(lambda: page.all('#detail [data-act="preview"]'), "the evidence")
    assert not page.all('#detail [data-act="anyway"]'), "it has not been fitted yet"
    page.after(lambda: page.click('#detail [data-act="preview"]'), "preview", "done")
    page.until(lambda: page.all('#detail [data-act="anyway"]'), "it is not supported")
    page.after(lambda: page.click('#detail [data-act="add"]'), "add", "refused")
    assert not open_study(study.folder).file.effects
    page.click(f'#ranking tr[data-label="{label}"]')
    page.after(lambda: page.click('#detail [data-act="anyway"]'), "add", "done")
    page.until(lambda: page.all("#undo:enabled"), "it can be undone")
    (added,) = open_study(study.folder).file.effects
    assert f"{added.effect}@{added.port}" == label
    assert list(lines(open_study(study.folder)))[-1]["reason"].startswith("added anyway: ")
    assert "added anyway" in page.text("#ledger ol.book li")
    page.after(lambda: page.click("#undo"), "undo", "done")
    assert not open_study(study.folder).file.effects


def test_data_that_changed_are_told_and_taken(page: Page, study: Study) -> None:
    opened(page)
    file = study.folder.parent / "train0.mcap"
    file.unlink()
    recorded(file, waves(5), UNITS)
    page.open(f"/study/{NAME}")
    page.until(lambda: "train0.mcap has changed" in page.text("#changed"), "the change")
    assert page.violations(dark=False) == []
    page.after(lambda: page.click('[data-act="accept_data"]'), "accept_data", "done")
    page.until(lambda: page.data("#held-out"), "the fit to the new data")
    assert not page.all("#changed")
    assert list(lines(open_study(study.folder)))[-1]["step"] == "accept-data"


def test_a_page_without_a_study_says_why(page: Page) -> None:
    page.errors()
    page.open("/study/nothing")
    assert "no such study" in page.text("main")
    assert page.violations(dark=False) == []
    assert [message for message in page.errors() if "404" not in message] == []

"""The list of studies: it shows what a study's process does, and what changed meanwhile."""

import contextlib
import shutil
import signal
from collections.abc import Iterator

import pytest

from rigwatch.workbench.study.study import Study
from tests.browser.page import Page, Served
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

pytestmark = pytest.mark.xdist_group("browser")
ROW = 'tr[data-study="listed/study"]'


@pytest.fixture
def study(served: Served) -> Study:
    return studied(served.folder / "listed", WAVES, [waves(0)], [waves(1)], UNITS)


def test_a_running_task_is_shown_and_its_result_when_it_ends(page: Page, study: Study) -> None:
    page.open("/")
    page.until(lambda: page.data(ROW, "running") == "", "a study at rest")
    assert "not fitted yet" in page.text(ROW).lower()
    assert page.data(f"{ROW} .last", "last").startswith("new, ")  # type: ignore[union-attr]
    page.run(
        "window.seen = new Set();"
        "const cell = () => document.querySelector(arguments[0] + ' .last');"
        "new MutationObserver(() => { const bar = cell()?.querySelector('progress');"
        " if (bar) window.seen.add(cell().textContent); })"
        ".observe(document.getElementById('studies'),"
        " {childList: true, subtree: true, characterData: true});"
        "fetch('/api/begin/listed/study', {method: 'POST', headers: {'content-type':"
        " 'application/json'}, body: JSON.stringify({task: 'explain', arguments: {}})})",
        ROW,
    )
    page.until(lambda: "missing" in page.text(ROW), "the verdict")
    page.until(lambda: page.data(ROW, "running") == "", "its end")
    assert page.run("return window.seen.size") > 0, "which of its lines depends on the machine"
    assert not page.all(f"{ROW} progress")
    assert page.data(f"{ROW} .last", "last") == page.text(f"{ROW} .last")
    assert page.violations(dark=True) == []
    # What is removed elsewhere leaves the list by itself.
    shutil.rmtree(study.folder)
    page.until(lambda: not page.all(ROW), "the study is gone")


@contextlib.contextmanager
def hanging(page: Page, served: Served) -> Iterator[None]:
    """The server hangs, and in the eyes of the page some time passes."""
    served.process.send_signal(signal.SIGSTOP)
    page.run("const now = Date.now; Date.now = () => now() + 20000;")
    try:
        yield
    finally:
        served.process.send_signal(signal.SIGCONT)


def test_a_page_whose_server_hangs_says_that_it_is_old_until_it_goes_on(
    page: Page, served: Served
) -> None:
    page.open("/")
    page.until(lambda: page.run("return performance.getEntriesByType('resource').length > 0"), "it")
    with hanging(page, served):
        page.until(lambda: "the figures are old" in page.text("#old"), "that it hangs")
    page.until(lambda: not page.text("#old"), "that it goes on")

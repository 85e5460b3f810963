"""Every page in every state that is drawn for it, in light and in dark, as axe judges it."""

from collections.abc import Iterator

from tests.browser.page import Page

TABS = ("missing", "where", "parameters", "data")
FITTED = "return Number(document.body.dataset.count || 0) >= 2"


def violations(page: Page, study: str) -> dict[str, list[str]]:
    """What axe finds on each page, by the page's name; empty where it finds nothing.

    Args:
        page: of a server with a study and without a rig.
        study: name of a study that has not been explained.
    """
    found = {}
    for name in _pages(page, study):
        for dark in (False, True):
            if told := page.violations(dark=dark):
                found[f"{name}, {'dark' if dark else 'light'}"] = told
    return found


def _pages(page: Page, study: str) -> Iterator[str]:
    """Each page in turn, once it shows what it has to show."""
    for path, ready in (
        ("/", "table.studies"),
        ("/new", "#parts tbody tr"),
        ("/rig", ".empty"),
        ("/study/none", ".empty"),
        ("/edit-model", "#text"),
        (f"/edit/effect/{study}", "#text"),
        ("/edit/effect/none", ".empty"),
    ):
        page.open(path)
        page.find(ready)
        yield path
    page.open(f"/study/{study}")
    page.until(lambda: page.run(FITTED), "the first fit")
    yield "a study before Explain"
    page.after(lambda: page.click("#explain"), "explain", "done")
    page.find("#ranking tbody tr")
    page.press("j")
    page.find("#detail h3")
    for tab in TABS:
        page.click(f"#tab-{tab}")
        yield f"the tab {tab}"
    page.press("?")
    page.find("#help[open]")
    yield "the list of keys"
    page.press("\ue00c")

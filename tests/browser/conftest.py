"""One server and one browser for all tests here."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser.page import Page, Served, browser, looking, serving


@pytest.fixture(scope="session")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with serving(tmp_path_factory.mktemp("workbench"), "--most-upload", "8") as found:
        yield found


@pytest.fixture(scope="session")
def page(served: Served) -> Iterator[Page]:
    with browser() as driver, looking(driver, served) as found:
        yield found


@pytest.fixture
def root(served: Served) -> Path:
    return served.folder

"""One server and one browser for all tests here."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser.page import Page, Served, browser


@pytest.fixture(scope="session")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    found = Served(tmp_path_factory.mktemp("workbench"), "--most-upload", "8")
    yield found
    found.end()
    assert not [line for line in found.said if "Traceback" in line], "".join(found.said)


@pytest.fixture(scope="session")
def page(served: Served) -> Iterator[Page]:
    with browser() as driver:
        found = Page(driver, served)
        found.enter()
        yield found
        assert found.errors() == []
        assert found.requests() <= {served.address}


@pytest.fixture
def root(served: Served) -> Path:
    return served.folder

"""Nothing on any page stands in anybody's way, and no page asks for anything elsewhere."""

from pathlib import Path

import pytest

from tests.browser.everywhere import violations
from tests.browser.page import Page
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

pytestmark = pytest.mark.xdist_group("browser")


def test_every_page_in_light_and_dark(page: Page, root: Path) -> None:
    studied(root / "waves", WAVES, [waves(0)], [waves(1)], UNITS)
    page.errors()
    assert violations(page, "waves/study") == {}
    # Pages of what is not there answer 404, which the browser reports; nothing else may be said.
    others = [told for told in page.errors() if "404" not in told]
    assert others == []
    assert page.requests() <= {page.served.address}

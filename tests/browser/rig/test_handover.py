"""A study's page at a rig whose monitor does not run: rehearsed, promoted and rolled back."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from monitor.model.model_file import load_model, model_text
from rigwatch.wire.session import SessionWriter, run_info
from rigwatch.workbench.steps.change import add
from rigwatch.workbench.study import lines, open_study
from rigwatch.workbench.study.study import Study
from tests.browser.page import Page, looking, serving
from tests.report.drive import MODEL, RATE, block, make_study
from tests.report.test_promote import RIG

pytestmark = pytest.mark.xdist_group("browser")


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """The model of a rig with a recording."""
    made = tmp_path / "model.toml"
    made.write_text(model_text(MODEL))
    recorded = tmp_path / "sessions" / "drive-20260101T000000Z"
    recorded.mkdir(parents=True)
    with SessionWriter(recorded / "000001.mcap", run_info("drive", RATE), sync=False) as writer:
        writer.write(block(3))
    text = RIG.format(model=made) + f'[recorder]\nfolder = "{tmp_path / "sessions"}"\n'
    (tmp_path / "rig.toml").write_text(text)
    return made


@pytest.fixture
def study(tmp_path: Path) -> Study:
    made = make_study(tmp_path / "studies")
    add(made, "coulomb", "load")
    return open_study(made.folder)


@pytest.fixture
def at_rig(page: Page, model: Path, study: Study) -> Iterator[Page]:
    """The browser at a server of its own."""
    assert page.errors() == []
    assert page.requests() <= {page.served.address}
    arguments = ("--rig", str(model.parent / "rig.toml"))
    with (
        serving(study.folder.parent, *arguments) as served,
        looking(page.driver, served) as found,
    ):
        yield found


def test_rehearsed_promoted_and_rolled_back(at_rig: Page, model: Path, study: Study) -> None:
    page, before = at_rig, model.read_bytes()
    page.open(f"/study/{study.folder.name}")
    page.until(lambda: page.data("#held-out"), "the fit")
    assert not page.all('[data-act="promote"]'), "what was not rehearsed does not go live"
    assert not page.all('[data-act="rollback"]'), "there is no model to go back to"
    page.after(lambda: page.click('[data-act="rehearse"]'), "rehearse", "done")
    page.until(lambda: "residual" in page.text("#rehearsal"), "what the monitor would say")
    page.after(lambda: page.click('[data-act="promote"]'), "promote", "done")
    page.until(lambda: page.all("#in-force"), "it is in force")
    assert load_model(model).promoted is not None
    assert not page.all('[data-act="promote"], [data-act="rehearse"], #rehearsal')
    assert page.violations(dark=False) == []
    page.after(lambda: page.click('[data-act="rollback"]'), "rollback", "done")
    page.until(lambda: page.all('[data-act="promote"]'), "it can go live again")
    assert model.read_bytes() == before
    assert not page.all('[data-act="rollback"], #in-force')
    steps = [line["step"] for line in lines(open_study(study.folder))]
    assert steps == ["new", "add", "promote", "rollback"]

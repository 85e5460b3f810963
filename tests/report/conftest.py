"""One study of the drive, with two effects accepted and one refused, for all tests here."""

from pathlib import Path

import pytest

from rigwatch.workbench.steps.change import add
from rigwatch.workbench.study.study import Study, open_study
from tests.report.drive import make_study


@pytest.fixture(scope="session")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    made = make_study(Path(tmp_path_factory.mktemp("drive")))
    assert add(made, "coulomb").step == "add"
    assert add(open_study(made.folder), "constant_force").step == "add"
    assert add(open_study(made.folder), "stribeck").step == "refused"
    return open_study(made.folder)

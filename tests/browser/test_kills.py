"""Whoever is killed while a step is written, study and ledger agree and nothing is lost."""

import random
from pathlib import Path

import pytest

from tests.browser.kills import Kills
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

pytestmark = pytest.mark.xdist_group("browser")


def test_kills_of_server_and_worker_lose_nothing(tmp_path: Path) -> None:
    studied(tmp_path, WAVES, [waves(0)], [waves(1)], UNITS)
    kills = Kills(tmp_path, "study", random.Random(7))
    kills.run(2)
    assert kills.wrong == []
    assert kills.steps >= 2  # the steps before and after the kills

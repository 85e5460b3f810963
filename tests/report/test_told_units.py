"""The browser's tables show errors in the unit in which the verdict tells them."""

from types import SimpleNamespace

import numpy as np
import pytest

from rigwatch.browser.views.pages import render
from rigwatch.workbench.compare.compare import Channel, Comparison

TURNS = np.pi / 30
"""A turn a minute [rad/s]."""
ERRORS = (2 * TURNS, 3 * TURNS, 4 * TURNS)


@pytest.fixture
def state() -> SimpleNamespace:
    """What the templates take of a study whose log is in turns a minute."""
    channels = {"speed": Channel(*ERRORS, "rad/s", told_in="rpm")}
    found = Comparison(*ERRORS, "rad/s", "its quiet band", channels, {}, [], [], told_in="rpm")
    file = SimpleNamespace(train=(), held_out=(), healthy=())
    model = SimpleNamespace(summary="", outputs={"speed": SimpleNamespace(unit="rad/s")})
    step = SimpleNamespace(number=0, label="model alone", comparison=found)
    ledger = [{"step": "add", "effect": "coulomb", "held_out_error": ERRORS[1], "data": {}}]
    return SimpleNamespace(
        comparison=found, study=SimpleNamespace(model=model), whole=SimpleNamespace(file=file),
        steps=[step], step=0, ledger=ledger, explanation=None,
    )  # fmt: skip


def test_the_channels_are_in_the_unit_of_the_log(state: SimpleNamespace) -> None:
    page = render("data.html", s=state, commands=[])
    row = page[page.index('<th scope="row">speed') :].split("</tr>")[0]
    assert [cell.split(">")[-1] for cell in row.split("</td>")[:-1]] == ["rpm", "2", "3", "4"]


def test_the_steps_and_the_ledger_are_in_the_unit_of_the_log(state: SimpleNamespace) -> None:
    page = render("ledger.html", s=state)
    assert '<span class="value">3 rpm</span>' in page
    assert '<span class="num">→ 3</span>' in page
    assert [float(part.split('"')[0]) for part in page.split('data-value="')[1:]] == (
        pytest.approx([3, 2, 4])
    )

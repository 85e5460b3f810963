"""Numbers are told with their units: the browser's tables have those of the verdict's sentence."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rigwatch.browser.views.pages import render
from rigwatch.workbench.compare.compare import Channel, Comparison
from rigwatch.workbench.fit import Value, shown

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


@pytest.mark.parametrize(
    ("unit", "told"),
    [("N", "0.178 N (0.1 … 0.25)"), ("1", "0.178 (0.1 … 0.25)"), ("1/s", "0.178 1/s (0.1 … 0.25)")],
)
def test_a_value_without_a_unit_is_told_without_one(unit: str, told: str) -> None:
    value = Value(0.178, unit, (0.1, 0.25))
    assert shown(value) == told
    assert shown(replace(value, interval=None)) == told.partition(" (")[0]

"""A promoted friction runs with the samples: however they are cut, and anew after a restart."""

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from monitor.model.model_file import PromotedSection, load_model
from monitor.pipeline.promoted import PromotedFriction
from monitor.signals.admission import GOOD, RESTART
from monitor.signals.residual import MODELLED, VELOCITY

MODEL = load_model(Path(__file__).parents[1] / "verify" / "model.toml")
KNOWN = structs.replace(MODEL, promoted=PromotedSection(coulomb=0.4, smooth=0.02))


def moving(count: int = 400) -> np.ndarray:
    """Columns of the residual stage: a velocity, and nothing else."""
    columns = np.zeros((count, 7))
    columns[:, VELOCITY] = 0.1 * np.sin(np.arange(count) / 9.0)
    return columns


def added(cuts: list[int], restart: int = -1) -> np.ndarray:
    columns, friction = moving(), PromotedFriction(KNOWN)
    code = np.full(len(columns), GOOD)
    if restart >= 0:
        code[restart] = RESTART
    for first, last in zip([0, *cuts], [*cuts, len(columns)], strict=True):
        friction.add(columns[first:last], code[first:last])
    return columns[:, MODELLED]


@pytest.mark.parametrize("cuts", [[1], [7, 8, 300], [399]])
def test_cuts_change_nothing(cuts: list[int]) -> None:
    assert np.array_equal(added(cuts), added([]))
    assert np.abs(added([])).max() > 0.1


def test_after_a_restart_it_begins_from_rest() -> None:
    begins = added([], restart=200)
    alone, friction = moving()[200:], PromotedFriction(KNOWN)
    friction.add(alone, np.full(len(alone), GOOD))
    assert np.array_equal(begins[200:], alone[:, MODELLED])


def test_without_anything_promoted_nothing_is_added() -> None:
    columns = moving()
    PromotedFriction(MODEL).add(columns, np.full(len(columns), GOOD))
    assert not columns[:, MODELLED].any()

"""How much worse a fit to two recordings may describe the healthy one."""

from dataclasses import replace
from pathlib import Path

import pytest

from rigwatch.physics.engine.fit import with_effects
from rigwatch.workbench.compare import Bench, refuse_what_spoils, shared_bench
from rigwatch.workbench.explain.motion_sensor import motion_sensor_rows
from rigwatch.workbench.ranking import Ranked, rank_all
from tests.workbench.kept_parameters.test_beside_healthy import CLOSE, bench

SENSOR = """
[ports.position_sensor]
kind = "sensor"
signal = "position"
"""


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """A stiffer slide and the healthy one in one training."""
    found = shared_bench(bench(tmp_path_factory.mktemp("slide"), stiffer=60.0))
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("healthy", "explains", "spoils"),
    [
        pytest.param(1.04, False, False, id="as before"),
        pytest.param(1.07, False, True, id="worse, for little"),
        pytest.param(1.07, True, False, id="a little worse, for nearly all of the error"),
        pytest.param(1.15, True, True, id="much worse"),
    ],
)
def test_the_healthy_recording_may_be_described_a_little_worse_by_what_explains_the_error(
    both: Bench, healthy: float, *, explains: bool, spoils: bool
) -> None:
    row = beside(both, healthy, explains=explains)
    refuse_what_spoils(both, [row])
    assert row.accepted != spoils


@pytest.mark.parametrize(("other", "spoils"), [(True, True), (False, False)])
def test_what_explains_the_error_and_leaves_the_healthy_recording_as_before_is_preferred(
    both: Bench, *, other: bool, spoils: bool
) -> None:
    worse, as_before = beside(both, 1.07, explains=True), beside(both, 1.0, explains=other)
    refuse_what_spoils(both, [worse, as_before])
    assert as_before.accepted
    assert worse.accepted != spoils


def beside(both: Bench, healthy: float, *, explains: bool) -> Ranked:
    """An effect that leaves so much of the healthy recording, over its own fit."""
    assert both.bare is not None
    own, fitted = both.bare.train, both.base
    first = len(with_effects(both.study.model, both.data.train))
    residuals = fitted.train.residuals.copy()
    tail = residuals.reshape(-1, residuals.shape[-1])[first:]
    tail[:] = (own.residuals / own.scale).reshape(-1, tail.shape[-1])[: len(tail)]
    tail *= healthy * fitted.train.scale
    left = fitted.held_out.residuals * (0.0 if explains else 0.9)
    (row,) = rank_all(both.study, both.data, both.base)[:1]
    row.accepted = True
    row.fitted = replace(
        fitted,
        train=replace(fitted.train, residuals=residuals),
        held_out=replace(fitted.held_out, residuals=left),
    )
    return row


def test_a_fault_of_the_motions_sensor_may_not_spoil_the_healthy_recording_either(
    tmp_path: Path,
) -> None:
    both = shared_bench(bench(tmp_path, CLOSE, ports=SENSOR, stiffer=-40.0))
    assert both is not None
    (row,) = motion_sensor_rows(both)
    assert row.label == "gain@position_sensor"
    assert row.reason == "the healthy recording is no longer described with it"

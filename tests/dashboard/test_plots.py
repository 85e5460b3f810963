"""What is drawn: every column once, ranges that stand still, batches that lose nothing."""

import math
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.dashboard.board import Dashboard, Facts, quantities
from rigwatch.dashboard.board.batches import Batches
from rigwatch.dashboard.board.entities import HEALTH_VIEWS
from rigwatch.dashboard.board.health import counters, view_of
from rigwatch.dashboard.board.quantities import ESTIMATE_PLOTS, SAMPLE_PLOTS, plots_of
from rigwatch.dashboard.board.ranges import around_signature, nice_above, peak, symmetric
from rigwatch.dashboard.board.survey import Survey
from rigwatch.wire.messages import MOST_FIGURES, MOST_SOURCES, Health
from rigwatch.wire.messages.message_types import Column, EstimateBlock, SampleBlock
from tests.dashboard.rig_messages import MARKS, Rig

RIG = Rig()
MESSAGES = list(RIG.messages(1.0))
SAMPLES = next(m for m in MESSAGES if isinstance(m, SampleBlock))
ESTIMATES = next(m for m in MESSAGES if isinstance(m, EstimateBlock))


@given(st.floats(1e-9, 1e9))
def test_nice_figures_are_close_above(value: float) -> None:
    nice = nice_above(value)
    assert value * (1 - 1e-6) <= nice <= 1.5 * value


@given(st.floats(1e-9, 1e9))
def test_symmetric_range_holds_the_peak(value: float) -> None:
    found = symmetric(value)
    assert found is not None
    low, high = found
    assert low == -high
    assert 1.1 * value <= high * (1 + 1e-6)


@pytest.mark.parametrize("nothing", [0.0, math.nan, math.inf])
def test_no_range_from_nothing(nothing: float) -> None:
    assert symmetric(nothing) is None
    assert around_signature(math.nan, -1.0, 1.0) is None
    assert around_signature(0.0, 0.0, 0.0) is None


@given(st.floats(0.01, 100), st.floats(0.001, 100))
def test_range_of_an_estimate_holds_marks(signature: float, limit: float) -> None:
    found = around_signature(signature, -limit, limit)
    assert found is not None
    assert found[0] < 0 < max(signature, limit) < found[1]


def test_peak_passes_over_what_is_no_number() -> None:
    assert peak(np.array([1.0, -3.0, np.nan, np.inf])) == 3.0
    assert peak(np.full(3, np.nan)) == 0.0


def test_range_does_not_follow_an_estimate_that_runs_away() -> None:
    survey = Survey()
    columns = ESTIMATES.columns
    for size in (1.0, 1e6):
        drawn = np.array([[-0.1, 0.1, 1.0, size]])
        survey.see(quantities.THETA1, columns, drawn)
    assert survey.plan()[0].range == (-0.75, 1.5)


def test_measured_and_modelled_share_an_axis() -> None:
    survey = Survey()
    survey.see(quantities.MEASURED, SAMPLES.channels, np.array([[2.0]]))
    survey.see(quantities.MODELLED, ESTIMATES.columns, np.array([[15.0]]))
    assert {line.range for line in survey.plan()} == {(-20.0, 20.0)}
    assert {line.title for line in survey.plan()} == {"Acceleration, measured and modelled [m/s²]"}


def test_every_column_is_drawn_once() -> None:
    stranger = Column("temperature", "K", np.zeros(len(SAMPLES)))
    plots = plots_of([*SAMPLES.channels, stranger], SAMPLE_PLOTS, "signals")
    assert [plot.path for plot in plots] == [
        "signals/voltage",
        "signals/position",
        "signals/acceleration/measured",
        "signals/temperature",
    ]
    plots = plots_of(ESTIMATES.columns, ESTIMATE_PLOTS, "details")
    assert [plot.path for plot in plots] == [
        "signals/acceleration/modelled",
        "monitor/residual",
        "monitor/theta1",
        "monitor/theta2",
        "details/deviation",
    ]


def test_drawn_values_are_scaled_and_marks_fill_what_is_missing() -> None:
    batches = Batches(MARKS)
    position = batches.add(quantities.POSITION, SAMPLES.t_ns, SAMPLES.channels)
    np.testing.assert_allclose(position[:, 0], 1e3 * SAMPLES.channel("position").values)
    theta1 = batches.add(quantities.THETA1, ESTIMATES.t_ns, ESTIMATES.columns)
    np.testing.assert_array_equal(theta1[:, 2], MARKS["theta1_signature"])
    np.testing.assert_array_equal(theta1[:, 3], ESTIMATES.column("theta1").values)


def test_no_mark_is_no_line() -> None:
    theta1 = Batches({}).add(quantities.THETA1, ESTIMATES.t_ns, ESTIMATES.columns)
    assert np.isnan(theta1[:, 2]).all()


@pytest.mark.parametrize(
    ("name", "view"),
    [
        ("rate_mean_hz", "rates"),
        ("latency_p99_ms", "times"),
        ("drift_ppm", "clock"),
        ("lost_samples", "losses"),
        ("crc_errors", "losses"),
        ("samples", "volumes"),
    ],
)
def test_counters_go_to_the_view_of_their_kind(name: str, view: str) -> None:
    assert view_of(name) == view
    assert view in HEALTH_VIEWS


def test_every_counter_is_drawn() -> None:
    assert {name for _, name, _ in counters(RIG.health(0))} == {
        f"daq {name}" for name in RIG.health(0).counters
    }


def test_processes_and_figures_that_are_made_up_stay_bounded(tmp_path: Path) -> None:
    stream = rr.RecordingStream("rigwatch", make_default=False)
    stream.save(tmp_path / "screen.rrd")
    board = Dashboard(stream, Facts("bench"))
    board.show(Health("monitor", 1, "running", "", {"lost_samples": 0.0}))
    for number in range(3 * MOST_SOURCES):
        figures = {f"figure_{number}_{i}": 0.0 for i in range(2 * MOST_FIGURES)}
        board.show(Health(f"p{number}", 1, "running", "", figures))
    board.show(Health("monitor", 2, "stale", "", {"lost_samples": 1.0}))
    assert len(board.facts.health) == MOST_SOURCES
    assert board.facts.health["monitor"].state == "stale"
    assert len(board._counters) == MOST_SOURCES * MOST_FIGURES

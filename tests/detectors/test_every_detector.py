"""What holds of every detector in the table, on the simulated rig."""

import json
from itertools import pairwise

import numpy as np
import pytest

from monitor.alarms import ALARM_KINDS
from monitor.detectors import DETECTORS, detector_kind
from monitor.detectors.detector import LONGEST_HOLD
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages import quality_flags as quality
from tests.detectors.simulated_rig import CHANNELS, RATE, block

FAULTS = {
    "parity-arma": ("coulomb", 0.75),
    "parity-ma": ("position_bias", 3e-3),
    "unknown-input-kalman": ("position_bias", 3e-3),
}
SEEDS = range(20, 26)


@pytest.fixture(params=DETECTORS, ids=lambda kind: kind.name)
def kind(request):
    return request.param


@pytest.fixture(scope="session")
def figures(rig):
    return {kind.name: kind.calibrate(rig.function, [rig.reference], RATE) for kind in DETECTORS}


@pytest.fixture
def new(rig, kind, figures):
    return lambda: kind.make(rig.function, figures[kind.name], CHANNELS, RATE)


def ran(detector, signals, cuts=()):
    """Columns and condition over all samples, cut at `cuts`, as one array."""
    edges = sorted({0, len(signals), *cuts})
    parts = []
    for first, last in pairwise(edges):
        columns, (condition,) = detector.update(block(signals[first:last], first))
        rows = [column.values for column in columns]
        rows += [condition.active.astype(float), condition.value, condition.low, condition.high]
        parts.append(np.array(rows))
    return np.hstack(parts)


def active(detector, signals):
    _, (condition,) = detector.update(block(signals))
    return np.flatnonzero(condition.active)


def test_every_detector_has_a_fault_to_find_here_and_an_alarm(kind):
    assert kind.name in FAULTS
    assert kind.condition in {alarm.name for alarm in ALARM_KINDS}
    assert detector_kind(kind.name) is kind


def test_the_configuration_offers_exactly_these(kind):
    from typing import get_args, get_type_hints

    from rigwatch.wire.rig_config import MonitorSection

    hint = get_type_hints(MonitorSection)["detectors"]
    assert kind.name in get_args(get_args(hint)[0])


def test_an_unknown_name_is_reported_with_the_known_ones():
    with pytest.raises(ModelError, match="parity-arma"):
        detector_kind("parity")


def test_the_cut_of_blocks_changes_no_bit(rig, new):
    signals = rig.with_fault("coulomb", 0.75, 12.0, seed=8)
    signals[700:704, 1] = np.nan
    cuts = np.random.default_rng(1).integers(1, len(signals), 60).tolist()
    whole = ran(new(), signals)
    assert np.isfinite(whole[0]).any()
    assert whole.tobytes() == ran(new(), signals, cuts).tobytes()
    assert whole.tobytes() == ran(new(), signals, range(1, len(signals), 7)).tobytes()


@pytest.mark.parametrize("seed", SEEDS)
def test_no_alarm_on_a_healthy_rig(rig, new, seed):
    healthy = rig.with_fault("coulomb", 0.0, 30.0, seed=seed)
    assert active(new(), healthy).size == 0


@pytest.mark.parametrize("seed", SEEDS[:3])
def test_its_fault_is_found(rig, kind, new, seed):
    signals = rig.with_fault(*FAULTS[kind.name], 20.0, seed=seed)
    found = active(new(), signals)
    assert found.size
    assert 0 <= found[0] - len(signals) // 2 < 0.05 * RATE


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("channel", [0, 1])
def test_what_is_not_finite_never_enters(rig, new, bad, channel):
    healthy = rig.with_fault("coulomb", 0.0, 20.0, seed=9)
    spoilt = healthy.copy()
    spoilt[3000:3004, channel] = bad
    rows = ran(new(), spoilt)
    assert np.isnan(rows[0, 3000:3004]).all()
    assert not rows[-4].any()
    assert np.isfinite(rows[0, 3020:]).all()


@pytest.mark.kernels
def test_flagged_samples_are_not_judged_and_do_no_harm(rig, new):
    healthy = rig.with_fault("coulomb", 0.0, 20.0, seed=10)
    flags = np.zeros(healthy.shape, np.uint8)
    flags[3000:3004, 1] = quality.SPIKE
    spiked = healthy.copy()
    spiked[3000:3004, 1] = 1.0
    columns, (condition,) = new().update(block(spiked, quality=flags))
    assert np.isnan(columns[0].values[3000:3004]).all()
    assert not condition.active.any()


def test_a_long_gap_starts_afresh_without_an_alarm(rig, new):
    healthy = rig.with_fault("coulomb", 0.0, 30.0, seed=12)
    detector = new()
    detector.update(block(healthy[:3000]))
    after = 3000 + LONGEST_HOLD + 500
    columns, (condition,) = detector.update(block(healthy[after:], after))
    assert np.isnan(columns[0].values[0])
    assert np.isfinite(columns[0].values[-1])
    assert not condition.active.any()


def test_a_short_gap_is_predicted_through_and_columns_stay_in_place(rig, new):
    healthy = rig.with_fault("coulomb", 0.0, 20.0, seed=14)
    lost, held = new(), new()
    lost.update(block(healthy[:3000]))
    columns, (condition,) = lost.update(block(healthy[3004:], 3004))
    spoilt = healthy.copy()
    spoilt[3000:3004] = np.nan
    expected, (same,) = held.update(block(spoilt))
    assert len(columns[0].values) == len(healthy) - 3004
    assert columns[0].values.tobytes() == expected[0].values[3004:].tobytes()
    assert condition.active.tobytes() == same.active[3004:].tobytes()


def test_samples_seen_before_are_passed_over(rig, new):
    healthy = rig.with_fault("coulomb", 0.0, 20.0, seed=13)
    once, twice = new(), new()
    once.update(block(healthy[:2000]))
    twice.update(block(healthy[:2000]))
    assert twice.update(block(healthy[1000:2000], 1000)) == ((), ())
    _, (condition,) = twice.update(block(healthy[1500:], 1500))
    _, (expected,) = once.update(block(healthy[2000:], 2000))
    assert condition.value[500:].tobytes() == expected.value.tobytes()


def test_figures_are_plain_numbers_for_the_model_file(kind, figures):
    plain = json.loads(json.dumps(figures[kind.name], allow_nan=False))
    assert plain == figures[kind.name]


def test_a_short_recording_is_refused_in_one_line(rig, kind):
    with pytest.raises(ModelError, match="healthy samples, expected at least"):
        kind.calibrate(rig.function, [rig.reference[:500]], RATE)

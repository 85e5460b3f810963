"""The pipeline: quiet while healthy, names friction and nothing else, survives bad input."""

import numpy as np
import pytest

from monitor.pipeline.pipeline import PUBLISHED, Monitor, Result
from monitor.signals import conditions as kinds
from rigwatch.wire.messages.message_types import Column, SampleBlock
from rigwatch.wire.messages.quality_flags import NON_FINITE
from sim_plant.effects import EFFECTS
from sim_plant.excitation import Shape, Sine, Square
from tests.monitor.monitor_rig import (
    OTHER_SINE,
    RATE,
    SINE,
    UNITS,
    active,
    block,
    fault,
    friction,
    model,
    run,
    watched,
)

ONSET = int(4.0 * RATE)
HEALTHY = run(SINE, 8.0, seed=21)
RUBBING = run(SINE, 8.0, friction(4.0), seed=22)


def values(result: Result, name: str) -> np.ndarray:
    return result.estimates.column(name).values


def test_a_healthy_rig_raises_nothing() -> None:
    result = watched(HEALTHY)
    assert values(result, "armed")[-1] == 1.0
    for kind in kinds.CONDITION_KINDS:
        assert not active(result, kind.name).any(), kind.name


@pytest.mark.parametrize("drive", [SINE, OTHER_SINE], ids=["known", "learnt"])
@pytest.mark.parametrize("level", [0.1, 0.4])
def test_friction_is_seen_at_once_and_named(drive: object, level: float) -> None:
    result = watched(run(drive, 8.0, friction(4.0, level), seed=23))  # type: ignore[arg-type]
    departed = np.flatnonzero(active(result, kinds.DEPARTURE))
    assert ONSET <= departed[0] <= ONSET + 4
    assert active(result, kinds.DRY_FRICTION)[-1] == 1
    assert not active(result, kinds.OTHER_FAULT).any()
    theta = values(result, "theta1")[-1]
    assert theta == pytest.approx(level / 0.4, rel=0.15)


@pytest.mark.parametrize(
    ("drive", "effects"),
    [(SINE, {}), (Square(amplitude=1.0, frequency=8.0), {"static_ratio": 1.3})],
    ids=["sine", "square"],
)
def test_plain_friction_is_named_within_a_cycle_and_a_half(
    drive: Shape, effects: dict[str, float]
) -> None:
    result = watched(run(drive, 6.0, friction(4.0, 0.8, **effects), seed=28))
    named = np.flatnonzero(active(result, kinds.DRY_FRICTION))
    assert ONSET < named[0] <= ONSET + 48


def test_a_rig_that_is_damped_to_rest_does_not_rub() -> None:
    drive, events = Square(amplitude=0.8, frequency=4.0), fault("viscous", 8.0)
    result = watched(run(drive, 10.0, events, seed=29))
    assert active(result, kinds.DEPARTURE)[ONSET:].any()
    assert not active(result, kinds.DRY_FRICTION).any()


def test_very_high_stiction_is_named_beside_friction() -> None:
    result = watched(run(SINE, 8.0, friction(4.0, 1.0, stiction=3.0), seed=24))
    assert active(result, kinds.STICTION)[-1] == 1
    assert active(result, kinds.DRY_FRICTION)[-1] == 1


@pytest.mark.parametrize(
    "name",
    [
        "viscous", "spring", "added_mass", "actuator_gain", "actuator_deadband", "actuator_lag",
        "chamber_leak", "supply_drop", "backlash", "periodic_force", "position_gain",
        "position_stuck", "acceleration_gain", "acceleration_noise", "acceleration_stuck",
        "voltage_gain", "voltage_noise",
    ],
)  # fmt: skip
def test_other_faults_are_alarmed_and_not_called_friction(name: str) -> None:
    result = watched(run(SINE, 8.0, fault(name, EFFECTS[name].typical), seed=25))
    assert active(result, kinds.DEPARTURE)[ONSET:].any()
    assert active(result, kinds.OTHER_FAULT)[ONSET:].any()
    assert not active(result, kinds.DRY_FRICTION).any()
    assert not active(result, kinds.STICTION).any()


@pytest.mark.parametrize("gap", [1.5e-3, 1.7e-3, 1.9e-3, 2.1e-3])
def test_a_mass_that_is_loose_and_coasts_does_not_stick(gap: float) -> None:
    """With play as wide as half of the rod's motion the mass is at rest at times, but drifts."""
    drive = Sine(amplitude=1.0, frequency=10.0)
    result = watched(run(drive, 8.0, fault("backlash", gap), seed=31))
    assert active(result, kinds.OTHER_FAULT)[ONSET:].any()
    assert not active(result, kinds.DRY_FRICTION).any()
    assert not active(result, kinds.STICTION).any()


@pytest.mark.parametrize("size", [1, 7, 256])
def test_cutting_into_blocks_changes_no_bit(size: int) -> None:
    whole = watched(RUBBING)
    monitor = Monitor(model())
    n = len(RUBBING["voltage"])
    parts = [monitor.update(block(RUBBING, k, min(k + size, n))) for k in range(0, n, size)]
    for name, _, _ in PUBLISHED:
        joined = np.concatenate([p.estimates.column(name).values for p in parts if p is not None])
        assert np.array_equal(joined, values(whole, name)), name


def test_published_outputs_come_first_and_are_not_copied() -> None:
    assert [row for _, _, row in PUBLISHED] == [*range(len(PUBLISHED))]
    result = watched(HEALTHY)
    departure = next(one for one in result.conditions if one.name == kinds.DEPARTURE)
    assert np.shares_memory(values(result, "deviation"), departure.value)


def test_a_block_seen_before_gives_nothing() -> None:
    monitor = Monitor(model())
    assert monitor.update(block(HEALTHY, 0, 100)) is not None
    assert monitor.update(block(HEALTHY, 0, 100)) is None
    late = monitor.update(block(HEALTHY, 50, 150))
    assert late is not None
    assert late.estimates.seq == 100
    assert len(late.estimates) == 50


def with_bad_samples(count: int, value: float) -> SampleBlock:
    whole = block(HEALTHY)
    columns = []
    for column in whole.channels:
        filled, quality = column.values.copy(), np.zeros(len(whole), np.uint8)
        if column.name == "acceleration":
            filled[1200 : 1200 + count] = value
            quality[1200 : 1200 + count] = NON_FINITE
        columns.append(Column(column.name, UNITS[column.name], filled, quality))
    return SampleBlock("rig", 1, 0, whole.device_us, whole.t_ns, tuple(columns))


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
@pytest.mark.parametrize("count", [1, 2, 60])
def test_invalid_samples_never_enter(value: float, count: int) -> None:
    result = Monitor(model()).update(with_bad_samples(count, value))
    assert result is not None
    for name, _, _ in PUBLISHED:
        assert np.all(np.isfinite(values(result, name))), name
    assert not active(result, kinds.DRY_FRICTION).any()
    assert active(result, kinds.SENSOR_INVALID).any() == (count > 2)
    assert values(result, "armed")[-1] == 1.0


@pytest.mark.parametrize("missing", [1, 2, 40])
def test_gaps_keep_the_phase_of_the_excitation(missing: int) -> None:
    monitor = Monitor(model())
    first = monitor.update(block(HEALTHY, 0, 1000))
    second = monitor.update(block(HEALTHY, 1000 + missing))
    assert first is not None
    assert second is not None
    assert second.estimates.seq == 1000 + missing
    gap = next(c for c in second.conditions if c.name == kinds.GAP)
    assert gap.active[0] == 1
    assert gap.value[0] == missing
    assert values(second, "armed")[-1] == 1.0
    assert not active(second, kinds.DRY_FRICTION).any()
    assert not active(second, kinds.OTHER_FAULT).any()


def test_a_new_boot_starts_over() -> None:
    monitor = Monitor(model())
    monitor.update(block(HEALTHY, 0, 1000))
    again = monitor.update(block(HEALTHY, 0, 2000, boot=2))
    assert again is not None
    assert values(again, "armed")[0] == 0.0
    assert values(again, "armed")[-1] == 1.0


def test_friction_from_the_start_shows_where_the_model_knows_the_excitation() -> None:
    result = watched(run(SINE, 6.0, friction(0.0), seed=26))
    assert active(result, kinds.DEPARTURE)[-1] == 1


def test_friction_from_the_start_that_the_model_cannot_know_is_learnt_and_that_is_reported() -> (
    None
):
    result = watched(run(OTHER_SINE, 6.0, friction(0.0), seed=26))
    assert not active(result, kinds.DEPARTURE).any()
    learnt = next(c for c in result.conditions if c.name == kinds.REFERENCE_LEARNT)
    armed = values(result, "armed") == 1.0
    assert np.array_equal(learnt.active == 1, armed)
    assert armed.any()
    assert learnt.value[armed][0] == pytest.approx(1.0, abs=0.2)


def test_nothing_is_reported_of_learning_where_the_model_knows_the_excitation() -> None:
    assert not active(watched(HEALTHY), kinds.REFERENCE_LEARNT).any()


def test_without_motion_friction_is_not_observable() -> None:
    still = {name: np.zeros(2000) for name in UNITS}
    result = watched(still)
    assert values(result, "observable").max() == 0.0
    assert not active(result, kinds.DRY_FRICTION).any()


def test_a_new_excitation_is_learnt_and_not_called_a_fault() -> None:
    before, after = run(SINE, 5.0, seed=27), run(OTHER_SINE, 9.0, seed=28)
    joined = {name: np.concatenate([before[name], after[name]]) for name in UNITS}
    result = watched(joined)
    assert active(result, kinds.EXCITATION_CHANGED).any()
    assert not active(result, kinds.DRY_FRICTION).any()
    assert values(result, "armed")[-1] == 1.0
    assert active(result, kinds.DEPARTURE)[-1] == 0


def test_a_missing_channel_is_named() -> None:
    whole = block(HEALTHY)
    short = SampleBlock("rig", 1, 0, whole.device_us, whole.t_ns, whole.channels[:2])
    with pytest.raises(KeyError, match="acceleration"):
        Monitor(model()).update(short)

"""The observer scheme on the simulated rig: any excitation, no recording of a known fault."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.model.model_file import model_text, parse_model
from monitor.observer import E, ObserverSignals
from monitor.observer.lagged_motion import DELAY, FixedLag, MotionColumn
from monitor.pipeline.observer_pipeline import ObserverMonitor
from monitor.pipeline.rig_monitor import RigMonitor
from monitor.signals import GOOD, NEW_BOOT
from monitor.signals.recordings import recording_of
from rigwatch.wire.errors import ConfigError, ModelError
from sim_plant.excitation import Recorded
from sim_plant.scenario import Event
from tests.monitor.observed_rig import (
    FAULTS,
    FREE,
    RATE,
    SINE,
    UNITS,
    block,
    coulomb,
    model,
    raised,
    run,
    watched,
)

pytestmark = pytest.mark.long


@pytest.mark.parametrize("drive", [SINE, FREE], ids=["locked", "free"])
def test_healthy_start_raises_nothing(drive) -> None:
    assert not FAULTS & raised(watched(run(drive, 10.0, seed=3))).keys()


@pytest.mark.parametrize("drive", [SINE, FREE], ids=["locked", "free"])
def test_friction_is_named_in_newtons(drive) -> None:
    found = watched(run(drive, 10.0, coulomb(6.0), seed=4))

    times = raised(found)
    assert 6.0 <= times["departure"] < 6.1
    assert 6.0 <= times["dry_friction"] < 6.5
    force = found.estimates.column("friction_force").values[round(8.0 * RATE) :]
    assert np.median(force) == pytest.approx(0.6, rel=0.2)


def test_a_drive_that_acts_later_is_remarked_on_with_its_lateness() -> None:
    channels = run(SINE, 6.0, seed=5)
    assert "drive_late" not in raised(watched(channels))
    at = np.arange(channels["voltage"].size)
    channels["voltage"] = np.interp(at + 0.6, at, channels["voltage"])

    found = watched(channels)

    assert not FAULTS & raised(found).keys()
    remark = next(each for each in found.announcements if each.name == "drive_late")
    assert remark.severity == "info"
    assert remark.value == pytest.approx(0.6, abs=0.1)
    assert remark.cause.endswith(f": {remark.value:+.2g} samples")


def jittering(voltage: np.ndarray) -> np.ndarray:
    """The voltage read before its steps, at half of the samples."""
    late = np.random.default_rng(6).random(voltage.size) < 0.5
    return np.where(late, np.roll(voltage, 1), voltage)


def test_steps_that_jitter_at_the_instants_of_sampling_hide_no_friction() -> None:
    channels = run(SINE, 12.0, coulomb(8.0), seed=6)
    channels["voltage"] = jittering(channels["voltage"])

    found = watched(channels)

    times = raised(found)
    assert min(times[name] for name in FAULTS & times.keys()) >= 8.0
    assert times["dry_friction"] < 8.3
    force = found.estimates.column("friction_force").values[round(10.0 * RATE) :]
    assert np.median(force) == pytest.approx(0.6, rel=0.2)


def test_steps_that_jitter_raise_the_limits() -> None:
    channels = run(SINE, 8.0, seed=6)
    steady = watched(channels).estimates.column("healthy_spread").values
    channels["voltage"] = jittering(channels["voltage"])

    unsteady = watched(channels).estimates.column("healthy_spread").values

    late = slice(round(6.0 * RATE), None)
    assert np.median(unsteady[late]) > 1.1 * np.median(steady[late])


@pytest.mark.parametrize("early", [0.3, 0.6])
def test_voltage_that_acts_earlier_than_in_commissioning_is_no_fault(early) -> None:
    channels = run(SINE, 12.0, coulomb(8.0), seed=6)
    voltage = channels["voltage"]
    channels["voltage"] = (1.0 - early) * voltage + early * np.roll(voltage, 1)

    found = watched(channels)

    times = raised(found)
    assert min(times[name] for name in FAULTS & times.keys()) >= 8.0
    assert times["dry_friction"] < 8.5
    force = found.estimates.column("friction_force").values[round(10.0 * RATE) :]
    assert np.median(force) == pytest.approx(0.6, rel=0.2)


def test_accelerometer_fault_is_not_called_friction() -> None:
    channels = run(SINE, 10.0, seed=5)
    channels["acceleration"][round(6.0 * RATE) :] *= 1.5

    names = raised(watched(channels)).keys()

    assert "other_fault" in names
    assert not names & {"dry_friction", "stiction"}


def test_position_that_jumps_is_reported_and_not_called_friction() -> None:
    channels = run(SINE, 10.0, seed=5)
    channels["position"][round(6.0 * RATE) :] += 2e-3

    times = raised(watched(channels))

    assert times["sensor_jumped.position"] == pytest.approx(6.0, abs=1.0 / RATE)
    assert times["other_fault"] == pytest.approx(6.0, abs=3.0 / RATE)
    assert not times.keys() & {"dry_friction", "stiction"}


def test_block_sizes_change_no_bit() -> None:
    channels = run(SINE, 5.0, coulomb(3.0), seed=6)
    whole = ObserverMonitor(model()).update(block(channels))
    assert whole is not None
    monitor, n = ObserverMonitor(model()), len(channels["voltage"])
    cuts = [0, 1, 2, 9, 40, 41, 300, 301, 777, n]
    parts = [monitor.update(block(channels, a, b)) for a, b in pairwise(cuts)]

    for column in whole.estimates.columns:
        pieces = [part.estimates.column(column.name).values for part in parts if part]
        assert np.array_equal(np.concatenate(pieces), column.values), column.name


def test_gap_restarts_and_says_that_it_is_not_armed() -> None:
    channels = run(SINE, 8.0, seed=7)
    monitor = RigMonitor(model())
    monitor.update(block(channels, 0, 1000))
    after = monitor.update(block(channels, 1100))
    assert after is not None

    flags = {c.name: c.active for c in after.conditions}
    assert flags["not_armed"][:200].all()
    assert not flags["not_armed"][600:].any()
    assert not any(flags[name].any() for name in FAULTS)


@pytest.mark.parametrize("start", ["crest", "crossing"])
def test_a_start_in_the_middle_of_a_drive_is_forgotten_as_soon_as_the_chambers_are(start) -> None:
    # The accelerometer's own mean is forgotten last: a rig of 0.17 Hz was called faulty for 3 s.
    known, channels = model(), run(SINE, 3.0, seed=31)
    voltage = channels["voltage"][256:288]
    first = 256 + int(np.argmax(voltage) if start == "crest" else np.argmin(np.abs(voltage)))
    values = np.column_stack([channels[name] for name in UNITS])

    def judged(begin: int) -> np.ndarray:
        code = np.full(len(values) - begin, GOOD)
        code[0] = NEW_BOOT
        signals = ObserverSignals(known.plant, known.remainder, RATE)
        return signals.update(values[begin:], code).judged[:, E]

    late = judged(first)[256:] - judged(0)[first + 256 :]

    assert np.abs(late).max() < 2.0 * known.healthy.noise


def test_mass_that_comes_to_rest_is_not_judged_until_it_has() -> None:
    until = np.arange(round(4.0 * RATE))
    fading = np.interp(until / RATE, [3.8, 4.0], [1.0, 0.0])
    stops = Recorded(samples=tuple(fading * SINE.source(RATE)(until)))

    found = watched(run(stops, 8.0, seed=8))

    armed = found.estimates.column("armed").values
    times = np.arange(armed.size) / RATE
    assert armed[(times > 3.0) & (times < 3.8)].all()
    assert not armed[(times > 4.05) & (times < 4.95)].any()
    assert armed[(times > 5.4) & (times < 5.7)].all()
    assert not FAULTS & raised(found).keys()


def test_motion_beyond_the_range_is_reported_and_not_judged() -> None:
    channels = run(SINE, 8.0, seed=8)
    grown = np.interp(np.arange(round(8.0 * RATE)) / RATE, [5.0, 6.0], [1.0, 8.0])
    for name in channels:
        channels[name] *= grown

    names = raised(watched(channels)).keys()

    assert "not_judged" in names
    assert not names & {"dry_friction", "stiction"}


def test_motion_beyond_the_range_is_judged_under_a_drive_that_was_recorded() -> None:
    stronger = (Event(at_s=6.0, effect="actuator_gain", value=1.6),)

    names = raised(watched(run(SINE, 10.0, stronger, seed=31))).keys()

    assert "other_fault" in names
    assert not names & {"not_judged", "dry_friction", "stiction"}


def test_model_file_keeps_every_bit() -> None:
    text = model_text(model())

    assert parse_model(text, "model.toml") == model()


def test_model_file_without_limits_is_refused() -> None:
    text = model_text(model())
    cut = text[: text.index("[healthy]")] + text[text.index("[scheme]") :]

    with pytest.raises(ConfigError, match="healthy"):
        parse_model(cut, "model.toml")


def test_rig_that_the_equations_do_not_describe_is_refused() -> None:
    from monitor.commissioning.equations import commission_equations

    rng = np.random.default_rng(1)
    channels = run(SINE, 10.0, seed=9)
    channels["acceleration"] = rng.permutation(channels["acceleration"])

    with pytest.raises(ModelError, match="cannot judge"):
        commission_equations([recording_of("healthy", "shuffled", RATE, channels)])


def test_no_healthy_recording_is_refused() -> None:
    from monitor.commissioning.equations import commission_equations

    with pytest.raises(ModelError, match="no healthy recording"):
        commission_equations([])


def test_motion_is_late_by_half_the_kernel() -> None:
    t = np.arange(200) / RATE
    x = np.column_stack([0.01 * t**3, t])
    code = np.zeros(200, np.int64)
    code[0] = 4
    lag = FixedLag([MotionColumn(0, 0), MotionColumn(0, 1), MotionColumn(1, DELAY)], 4, RATE)

    columns, state = lag.update(x, code)

    assert state[:8].max() == 0
    assert state[8] == 1
    assert np.allclose(columns[8:, 0], 0.01 * t[4:-4] ** 3, atol=1e-12)
    assert np.allclose(columns[8:, 1], 0.03 * t[4:-4] ** 2, atol=1e-9)
    assert np.array_equal(columns[8:, 2], t[4:-4])


@pytest.mark.parametrize("effect", [("actuator_gain", 0.95), ("actuator_gain", 0.9)])
def test_a_lost_gain_of_the_drive_is_not_called_friction(effect: tuple[str, float]) -> None:
    """At the resonance it is in phase with the speed, as friction is."""
    name, value = effect
    lost = (Event(at_s=6.0, effect=name, value=value),)

    names = raised(watched(run(SINE, 10.0, lost, seed=31))).keys()

    assert "other_fault" in names
    assert not names & {"dry_friction", "stiction"}

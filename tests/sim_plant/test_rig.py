"""What the device hands over: numbers, clock, codes; the same for a seed however the run is cut."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from rigwatch.wire.errors import ModelError
from sim_plant.parameters import GRAVITY, RigParameters
from sim_plant.rig import CHANNELS, Rig

from .rig_runs import settled, sine


def test_same_seed_same_samples_and_another_seed_other_noise():
    one, two, other = (
        Rig(RigParameters(), seed).advance(sine(1.0, 8.0, 1.0)) for seed in (1, 1, 2)
    )
    assert np.array_equal(one.codes, two.codes)
    assert not np.array_equal(one.codes, other.codes)
    assert np.array_equal(one.truth["x"], other.truth["x"])


@given(cuts=st.lists(st.integers(0, 700), max_size=12))
@settings(max_examples=25, deadline=None)
def test_cutting_a_run_changes_nothing(cuts: list[int]):
    def run(places: list[int]) -> tuple[np.ndarray, np.ndarray]:
        rig = Rig(RigParameters(), seed=5)
        rig.set_effect("coulomb", 0.8, over_s=1.3)
        rig.set_effect("acceleration_delay", 0.01)
        rig.set_effect("actuator_lag", 0.01)
        rig.set_effect("backlash", 1e-3)
        rig.set_effect("position_spikes", 1e-3)
        pieces = np.split(sine(1.4, 8.0, 700 / 256), places)
        parts = [rig.advance(piece) for piece in pieces]
        codes = np.concatenate([part.codes for part in parts])
        return codes, np.concatenate([part.truth["a"] for part in parts])

    whole_codes, whole_a = run([])
    codes, a = run(sorted(cuts))
    assert np.array_equal(codes, whole_codes)
    assert np.array_equal(a, whole_a)


def test_numbers_and_device_clock():
    rig = Rig(structs.replace(RigParameters(), clock_drift=100.0), seed=0)
    first, second = rig.advance(np.zeros(100)), rig.advance(np.zeros(25501))
    assert first.seq.tolist() == list(range(100))
    assert second.seq[0] == 100
    assert second.device_us[-1] == 100_010_000
    assert first.codes.dtype == np.int16
    assert first.codes.shape == (100, len(CHANNELS))


def test_codes_calibrate_to_what_happened():
    samples, p = settled(1.4, 8.0), RigParameters()
    si = samples.codes * p.si_per_code
    assert np.abs(si[:, 0] - samples.truth["voltage"]).max() < 0.01
    assert np.abs(si[:, 1] - samples.truth["x"]).max() < p.lvdt_resolution / 2 + 6 * p.lvdt_noise
    difference = si[:, 2] - samples.truth["a"]
    # The piezo's high-pass turns an 8 Hz sine by 3.6 degrees; the mean is gone.
    assert np.std(difference) < 0.08 * np.std(samples.truth["a"])


def test_lvdt_resolves_a_thousandth_of_an_inch_and_saturates_at_an_inch():
    rig = Rig(RigParameters(), seed=0)
    samples = rig.advance(np.full(256 * 3, 3.0))
    position = samples.codes[:, 1] * RigParameters().si_per_code[1]
    steps = position / RigParameters().lvdt_resolution
    assert np.abs(steps - np.round(steps)).max() < 0.035  # the upper rail
    assert samples.truth["x"].max() > 0.05
    assert position.max() == pytest.approx(0.0254, rel=1e-4)
    assert samples.codes[:, 1].max() == 32767


def test_accelerometer_has_no_response_to_rest_and_little_noise():
    rig = Rig(RigParameters(), seed=0)
    a = rig.advance(np.zeros(256 * 20)).codes[:, 2] * RigParameters().si_per_code[2]
    assert abs(a.mean()) < 1e-3 * GRAVITY
    assert 1e-3 * GRAVITY < a.std() < 6e-3 * GRAVITY


def test_accelerometer_saturates_at_its_rail():
    rig = Rig(RigParameters(), seed=0)
    rig.set_effect("acceleration_gain", 1000.0)
    codes = rig.advance(sine(1.4, 8.0, 2.0)).codes[:, 2]
    assert codes.max() == 32767
    assert codes.min() == -32768


def test_voltage_channel_shows_what_the_valve_gets_centring_included():
    rig = Rig(RigParameters(), seed=0)
    rig.set_effect("constant_force", 0.3)
    truth = rig.advance(np.zeros(256 * 30)).truth
    assert truth["voltage"][-1] == pytest.approx(
        -RigParameters().centring_gain * truth["x"][-1], rel=1e-3
    )


def test_command_must_be_finite():
    with pytest.raises(ModelError, match="not finite"):
        Rig(RigParameters(), seed=0).advance(np.array([0.0, np.nan]))


def test_no_samples_are_fine():
    samples = Rig(RigParameters(), seed=0).advance(np.empty(0))
    assert len(samples) == 0

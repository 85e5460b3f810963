"""Every declared effect acts where it says and goes away again; listing one brings it here."""

import numpy as np
import pytest

from rigwatch.wire.errors import ModelError
from sim_plant.effects import CHANNELS, EFFECTS, Effect
from sim_plant.parameters import RigParameters
from sim_plant.rig import RawSamples, Rig

from .rig_runs import sine


def run(effect: Effect, *, on: bool, needs: bool = True) -> RawSamples:
    rig = Rig(RigParameters(), seed=11)
    rig.advance(sine(1.4, 8.0, 3.0))
    for name, value in effect.needs if needs else ():
        rig.set_effect(name, value)
    rig.set_effect(effect.name, effect.typical if on else effect.neutral)
    return rig.advance(sine(1.4, 8.0, 3.0, start=3.0))


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_effect_changes_its_channel(effect: Effect):
    without, with_it = run(effect, on=False), run(effect, on=True)
    change = np.abs(with_it.codes.astype(int) - without.codes.astype(int)).max(axis=0)
    assert all(np.isfinite(values).all() for values in with_it.truth.values())
    if effect.place in CHANNELS:
        expected = [channel == effect.place for channel in CHANNELS]
        assert [bool(c) for c in change > 3] == expected
        assert np.array_equal(with_it.truth["x"], without.truth["x"])
    else:
        assert change[1] > 20
        assert change[2] > 20


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_neutral_value_is_no_effect(effect: Effect):
    plain = Rig(RigParameters(), seed=11)
    plain.advance(sine(1.4, 8.0, 3.0))
    expected = plain.advance(sine(1.4, 8.0, 3.0, start=3.0))
    assert np.array_equal(run(effect, on=False, needs=False).codes, expected.codes)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_healthy_again_after_an_effect_has_gone(effect: Effect):
    rig = Rig(RigParameters(), seed=11)
    rig.advance(sine(1.4, 8.0, 3.0))
    rig.set_effect(effect.name, effect.typical)
    rig.advance(sine(1.4, 8.0, 1.0, start=3.0))
    rig.set_effect(effect.name, effect.neutral)
    rig.advance(sine(1.4, 8.0, 16.0, start=4.0))
    again = rig.advance(sine(1.4, 8.0, 1.0, start=20.0))
    plain = Rig(RigParameters(), seed=11)
    plain.advance(sine(1.4, 8.0, 20.0))
    expected = plain.advance(sine(1.4, 8.0, 1.0, start=20.0))
    difference = np.abs(again.codes.astype(int) - expected.codes.astype(int)).max(axis=0)
    assert difference[0] <= 2
    assert difference[1] <= 40  # LVDT steps of 33 codes
    assert difference[2] <= 3


def test_there_are_enough_faults_that_are_not_dry_friction():
    assert sum(not effect.dry for effect in EFFECTS.values()) >= 15
    assert all(effect.low <= effect.neutral <= effect.high for effect in EFFECTS.values())
    assert all(effect.low <= effect.typical <= effect.high for effect in EFFECTS.values())


def test_ramp_is_even_and_ends_at_its_value():
    rig = Rig(RigParameters(), seed=0)
    rig.set_effect("coulomb", 1.0, over_s=1.0)
    seen = []
    for _ in range(40):
        rig.advance(np.zeros(8))
        seen.append(rig.effects["coulomb"])
    assert np.allclose(seen[:32], np.arange(32) / 32)
    assert seen[-1] == 1.0


def test_drift_grows_with_time():
    rig = Rig(RigParameters(), seed=0)
    rig.set_effect("position_drift", 1e-4)
    metres = rig.advance(np.zeros(256 * 20)).codes[:, 1] * RigParameters().si_per_code[1]
    assert metres[-256:].mean() == pytest.approx(19.5e-4, rel=0.02)


def test_delay_and_lag_of_a_sensor():
    rig = Rig(RigParameters(), seed=0)
    rig.set_effect("voltage_delay", 10.5 / 256)
    volts = rig.advance(np.r_[np.zeros(20), np.ones(20)]).codes[:, 0] * 10.0 / 32768
    assert np.allclose(volts[:30], 0.0, atol=0.01)
    assert volts[30] == pytest.approx(0.5, abs=0.01)
    assert np.allclose(volts[31:], 1.0, atol=0.01)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("coulom", 1.0, "'coulomb'?"),
        ("coulomb", -1.0, "expected a finite number from 0"),
        ("coulomb", float("nan"), "found nan"),
        ("actuator_delay", 3.0, "0.45 s"),
    ],
)
def test_wrong_effects_are_refused(name: str, value: float, says: str):
    rig = Rig(RigParameters(), seed=0)
    with pytest.raises(ModelError, match="effect") as error:
        rig.set_effect(name, value)
    assert says in str(error.value)

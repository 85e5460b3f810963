"""A drive that never repeats: no false alarm, friction is noticed, and no name is made up."""

from functools import cache

import numpy as np
import pytest

from monitor.pipeline.pipeline import Result
from monitor.reference.reference_state import STRETCHES, ReferenceRules, new_reference
from monitor.signals import conditions as kinds
from sim_plant.excitation import Chirp, Multisine, Recorded, Shape
from tests.monitor.monitor_rig import RATE, SINE, UNITS, active, friction, run, watched

ARMED_BY = 25.0
"""Eight seconds in which no period is found, sixteen that are learnt from [s]."""


@cache
def noise(gain: float = 1.0) -> Recorded:
    """Noise of 1 to 15 Hz, four minutes of it."""
    lines = np.arange(240, 3600)
    spectrum = np.zeros(30721, np.complex128)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(3).random(lines.size))
    volts = np.fft.irfft(spectrum, 61440)
    return Recorded(samples=tuple((0.6 * volts / volts.std()).tolist()), loop=True, gain=gain)


DRIVES = [
    pytest.param(noise, id="noise"),
    pytest.param(lambda: Multisine(amplitude=1.4, start=0.5, stop=20.0, period=65536), id="lines"),
    pytest.param(lambda: Chirp(amplitude=0.7, start=0.5, stop=20.0, length_s=16.0), id="chirp"),
]
FAULTS = (kinds.DEPARTURE, kinds.DRY_FRICTION, kinds.STICTION, kinds.OTHER_FAULT)


def said(result: Result, name: str, before: int = 0) -> bool:
    return bool(active(result, name)[before:].any())


@pytest.mark.parametrize("drive", DRIVES)
def test_a_healthy_rig_raises_nothing(drive: object) -> None:
    result = watched(run(drive(), 240.0, seed=41))  # type: ignore[operator]
    armed = result.estimates.column("armed").values
    assert armed[int(ARMED_BY * RATE) :].all()
    for name in (*FAULTS, kinds.EXCITATION_CHANGED):
        assert not said(result, name), name
    assert said(result, kinds.REFERENCE_LEARNT)


def test_its_stretches_have_room_whatever_the_longest_period_is() -> None:
    rules = ReferenceRules(
        settle=8, learn=8, longest_period=4, residual_noise=1.0, position_noise=1.0,
        voltage_noise=1.0, fixed=False,
    )  # fmt: skip
    reference = new_reference(rules, [])
    assert reference.sums.shape[1] >= STRETCHES


@pytest.mark.parametrize(("level", "within_s"), [(0.1, 8.0), (0.2, 4.0), (0.4, 4.0)])
@pytest.mark.parametrize("drive", DRIVES[:2])
def test_friction_is_noticed_and_not_called_something_else(
    drive: object, level: float, within_s: float
) -> None:
    onset = 40.0
    result = watched(run(drive(), 50.0, friction(onset, level), seed=42))  # type: ignore[operator]
    departed = np.flatnonzero(active(result, kinds.DEPARTURE))
    assert onset < departed[0] / RATE < onset + within_s
    for name in (*FAULTS[1:], kinds.EXCITATION_CHANGED):
        assert not said(result, name), name


def test_friction_is_not_learnt_as_healthy() -> None:
    result = watched(run(noise(), 120.0, friction(40.0, 0.4), seed=43))
    late = active(result, kinds.DEPARTURE)[int(60 * RATE) :]
    assert late.mean() > 0.9


@pytest.mark.parametrize("drive", [noise(2.0), noise(0.3), SINE], ids=["loud", "low", "sine"])
def test_another_drive_is_no_fault(drive: Shape) -> None:
    before, after = run(noise(), 40.0, seed=44), run(drive, 60.0, seed=45)
    joined = {name: np.concatenate([before[name], after[name]]) for name in UNITS}
    result = watched(joined)
    for name in FAULTS[1:]:
        assert not said(result, name), name
    assert result.estimates.column("armed").values[-1] == 1.0
    assert not active(result, kinds.DEPARTURE)[-int(10 * RATE) :].any()

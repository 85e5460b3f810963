"""Square waves of a generator with a clock of its own, on the simulated rig."""

from functools import cache

import numpy as np
import pytest

from monitor.commissioning.equations import commission_equations
from monitor.model import RigModel
from monitor.signals.recordings import recording_of
from sim_plant.excitation import Periodic, Square
from tests.monitor.observed_rig import FAULTS, RATE, coulomb, healthy_recordings, raised, run
from tests.monitor.observed_rig import watched as watched_by

pytestmark = pytest.mark.nightly

SQUARE = Square(amplitude=1.2, frequency=8.0)


class Shifted(Square, frozen=True, kw_only=True):
    """A square wave as it is read: `ahead` of the first sample [samples]."""

    ahead: float = 0.0

    def wave(self, cycle: np.ndarray) -> np.ndarray:
        return super().wave(cycle + self.ahead * self.frequency / RATE)


class Between(Periodic, frozen=True, kw_only=True):
    """A square wave whose edges lie between samples: its mean until the next sample."""

    ahead: float = 0.0

    def wave(self, cycle: np.ndarray) -> np.ndarray:
        step = self.frequency / RATE
        cycle = cycle + self.ahead * step
        return (_risen(cycle + step) - _risen(cycle)) / step


def _risen(cycle: np.ndarray) -> np.ndarray:
    """Integral of a square wave."""
    return 0.5 - np.abs(cycle % 1.0 - 0.5)


@cache
def model() -> RigModel:
    square = recording_of("healthy", "square", RATE, run(SQUARE, 10.0, seed=23))
    return commission_equations([*healthy_recordings(), square])


def free(
    clock: float, seconds: float, events: tuple = (), ahead: float = 0.0
) -> dict[str, np.ndarray]:
    """A run of which the voltage is read at the samples."""
    wave = {"amplitude": 1.2, "frequency": 8.0 * clock, "ahead": ahead}
    channels = run(Between(**wave), seconds, events, seed=7)
    channels["voltage"] = run(Shifted(**wave), seconds, seed=7)["voltage"]
    return channels


@pytest.mark.parametrize(
    ("clock", "ahead"), [(0.98, 0.0), (0.995, 0.0), (1.01, 0.0), (0.9998, 0.9)]
)
def test_friction_is_noticed_and_nothing_before_it(clock, ahead) -> None:
    times = raised(watched_by(free(clock, 12.0, coulomb(8.0), ahead), model()))

    assert min(times[name] for name in FAULTS & times.keys()) >= 8.0
    assert times["departure"] < 8.2
    assert times["dry_friction"] < 8.5


def test_edges_at_samples_of_another_frequency_are_no_fault() -> None:
    locked = run(Square(amplitude=1.2, frequency=8.03), 12.0, seed=8)

    assert not FAULTS & raised(watched_by(locked, model())).keys()

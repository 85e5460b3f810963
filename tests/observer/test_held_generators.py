"""Generators that hold each voltage for several samples: readings repeat, and none is old."""

from collections.abc import Callable

import numpy as np
import pytest

from monitor.commissioning.equations import commission_equations
from monitor.signals.recordings import recording_of
from sim_plant.excitation import Recorded
from tests.monitor.observed_rig import FAULTS, RATE, coulomb, raised, run, watched

pytestmark = pytest.mark.long

FINE = 64
"""Instants at which the voltage is taken within a sample."""

Wave = Callable[[np.ndarray], np.ndarray]


def sine(t: np.ndarray) -> np.ndarray:
    return 1.4 * np.sin(2.0 * np.pi * 8.0 * t)


def triangle(t: np.ndarray) -> np.ndarray:
    return 1.2 * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * 8.0 * t))


def slower(t: np.ndarray) -> np.ndarray:
    return np.sin(2.0 * np.pi * 6.0 * t)


def sweep(t: np.ndarray) -> np.ndarray:
    """0.5 to 20 Hz within 14 s."""
    return 0.7 * np.sin(2.0 * np.pi * (0.5 * t + 0.5 * (19.5 / 14.0) * t**2))


def held(
    wave: Wave,
    updates_hz: float,
    seconds: float,
    *,
    between: bool,
    late: float = 0.0,
    events=(),
    seed: int = 11,
) -> dict[str, np.ndarray]:
    """A run with a voltage that is updated at samples, or between them; read at samples.

    It acts late by a part of a sample.
    """
    n = round(seconds * RATE)
    t = np.arange(n * FINE) / (RATE * FINE)
    fine = wave(np.floor(t * updates_hz + 1e-9) / updates_hz)
    read, fine = fine[::FINE], np.roll(fine, round(late * FINE))
    acts = fine.reshape(n, FINE).mean(axis=1) if between else read
    channels = run(_recorded(acts), seconds, events, seed)
    channels["voltage"] = run(_recorded(read), seconds, seed=seed)["voltage"]
    return channels


def _recorded(samples: np.ndarray) -> Recorded:
    return Recorded(samples=tuple(samples.tolist()))


@pytest.mark.parametrize(
    ("updates_hz", "between"),
    [(200.0, False), (128.0, False), (97.3, False), (60.0, False), (50.0, False),
     (170.0, True), (118.0, True), (97.3, True), (60.0, True), (48.0, True)],
)  # fmt: skip
def test_friction_is_noticed_and_nothing_before_it(updates_hz: float, between: bool) -> None:
    friction = coulomb(7.0)
    times = raised(watched(held(sine, updates_hz, 9.0, between=between, events=friction)))

    assert min(times[name] for name in FAULTS & times.keys()) >= 7.0
    assert times["departure"] < 7.2
    assert times["dry_friction"] < 7.5


@pytest.mark.parametrize(("wave", "off"), [(triangle, 1e-3), (sine, -7e-4)])
def test_friction_is_noticed_while_the_steps_slide(wave: Wave, off: float) -> None:
    # It sets in while the generator's clock is not yet known, and while a lateness is remembered.
    voltage = held(wave, RATE * (1.0 + off), 18.0, between=True, events=coulomb(10.0))
    times = raised(watched(voltage))

    assert min(times[name] for name in FAULTS & times.keys()) >= 10.0
    assert "dry_friction" in times


@pytest.mark.parametrize("late", [0.35, 0.9])
def test_friction_beside_a_constant_lateness_is_noticed_as_soon(late: float) -> None:
    voltage = held(sine, RATE, 9.0, between=True, late=late, events=coulomb(7.0))
    times = raised(watched(voltage))

    assert min(times[name] for name in FAULTS & times.keys()) >= 7.0
    assert times["departure"] < 7.1
    assert times["dry_friction"] < 7.2


@pytest.mark.nightly
def test_commissioning_takes_held_readings_as_they_are() -> None:
    drives = (("chirp", "sweep", sweep, 14.0), ("healthy", "sine", sine, 10.0),
              ("healthy", "slower", slower, 10.0))  # fmt: skip
    recordings = [
        recording_of(role, name, RATE, held(wave, 100.0, seconds, between=False, seed=20 + k))
        for k, (role, name, wave, seconds) in enumerate(drives)
    ]

    model = commission_equations(recordings)

    assert model.scheme is not None
    assert model.scheme.share < 0.06
    assert model.noise.residual < 0.05

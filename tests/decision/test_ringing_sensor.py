"""Friction is named though a sensor rings on its bracket after each reversal; nothing else is."""

import numpy as np
import pytest

from monitor.observer import decision_state as d
from rigwatch.wire.arrays import FloatArray
from tests.lost_samples.test_judged_once import BEGIN, END, NOISE, PERIOD, SPEED, judged, losing

FRICTION = 12.0 * NOISE
RATE, RESONANCE, DECAY = 256, 95.0, 8.0
"""Sample rate and resonance [Hz], and samples in which the ringing falls to a third."""


def ringing(size: float) -> FloatArray:
    """What a bracket adds: after each reversal it rings from the size of the force's jump."""
    since = np.arange(END) % (PERIOD // 2)
    wave = np.exp(-since / DECAY) * np.cos(2 * np.pi * RESONANCE / RATE * since)
    return np.asarray(-size * np.sign(SPEED) * wave)


@pytest.mark.parametrize("seed", range(10))
def test_friction_is_named_at_once_though_the_sensor_rings(seed: int) -> None:
    left = -FRICTION * np.sign(SPEED) + ringing(2.0 * FRICTION)
    verdict = judged(left, losing(0), seed)[d.VERDICT]
    assert (verdict[BEGIN + 2 * PERIOD :] == d.FRICTION).all()


@pytest.mark.parametrize("seed", range(10))
def test_ringing_alone_is_not_friction(seed: int) -> None:
    verdict = judged(ringing(2.0 * FRICTION), losing(0), seed)[d.VERDICT]
    assert not np.isin(verdict, (d.FRICTION, d.STICKING)).any()
    assert (verdict[BEGIN + d.LASTING :] == d.OTHER).all()


@pytest.mark.parametrize("seed", range(10))
def test_a_louder_sensor_is_not_friction(seed: int) -> None:
    louder = 6.0 * NOISE * np.random.default_rng(100 + seed).standard_normal(END)
    verdict = judged(louder, losing(0), seed)[d.VERDICT]
    assert not np.isin(verdict, (d.FRICTION, d.STICKING)).any()

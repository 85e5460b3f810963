"""Shapes of candidate excitations, with amplitude 1."""

from collections.abc import Callable

import numpy as np

from rigwatch.wire.arrays import FloatArray

Shape = Callable[[FloatArray], FloatArray]


def shapes(length: float, dt: float) -> dict[str, Shape]:
    """Excitations of amplitude 1."""
    found: dict[str, Shape] = {}
    for periods in (2, 8, 32):
        rate = periods / length
        if rate < 0.05 / dt:
            found[f"sine of {rate:.2g} Hz"] = _sine(rate)
            found[f"steps of {rate:.2g} Hz"] = _steps(rate)
            found[f"triangle of {rate:.2g} Hz"] = _triangle(rate)
    found["triangle of growing speed"] = lambda t: _triangle(1.0)(2 + 8 * (t / length) ** 2)
    found["sines of many frequencies"] = _multisine(length, dt)
    return found


def _sine(rate: float) -> Shape:
    return lambda t: np.asarray(np.sin(2 * np.pi * rate * t))


def _steps(rate: float) -> Shape:
    return lambda t: np.asarray(np.tanh(8 * np.sin(2 * np.pi * rate * t)))


def _triangle(rate: float) -> Shape:
    return lambda t: np.asarray(2 / np.pi * np.arcsin(np.sin(2 * np.pi * rate * t)))


def _multisine(length: float, dt: float) -> Shape:
    lines = np.arange(2, max(4, int(0.02 * length / dt)))
    phases = -np.pi * lines * (lines - 1) / len(lines)

    def shape(t: FloatArray) -> FloatArray:
        waves = np.cos(2 * np.pi * np.outer(t, lines) / length + phases).sum(axis=1)
        return np.asarray(waves / np.abs(waves).max())

    return shape

# ruff: noqa: ARG005 -- laws of one kind take the same arguments
"""Contacts at the mass that remember how they were bent before they slip.

Each takes the step of the mass and changes its own bending by it; forces in N, lengths in m.
"""

import math
from collections.abc import Callable

Contact = Callable[[float, float, float, float], float]
"""Time, position, velocity and step → force."""


class SlipElement:
    """A spring in series with a dry slider: it stretches until the slider slips.

    Args:
        stretch: at which it slips.
        force: of the slider.
        more: share of the force by which it holds more at rest, which fades within `creep` [m/s].
        settles: share of the force that is lost as it runs in, along `path`.
    """

    def __init__(
        self,
        stretch: float,
        force: float,
        *,
        more: float = 0.0,
        creep: float = 0.15,
        settles: float = 0.0,
        path: float = 0.8,
    ) -> None:
        self._most, self._force, self._stretched = stretch, force, 0.0
        self._more, self._creep = more, creep
        self._settles, self._path, self._slid = settles, path, 0.0

    def __call__(self, _t: float, _x: float, v: float, h: float) -> float:
        """The slider's force."""
        self._slid += abs(v) * h
        most = self._most * (1 + self._more * math.exp(-abs(v) / self._creep))
        self._stretched = max(-most, min(most, self._stretched + v * h))
        holds = self._force * (1 + self._settles * math.exp(-self._slid / self._path))
        return -holds * self._stretched / self._most

    def moved(self, way: float, step: float) -> float:
        """The slider's force after it was moved by `way` within a step [s]."""
        return self(0.0, 0.0, way / step, step)


class Bent:
    """Bristles that bend towards the way of sliding, a share of the rest in each stretch of it.

    The way of a step is followed exactly, as an exponential.
    """

    def __init__(self, length: float) -> None:
        self._length, self.bend = length, 0.0

    def move(self, way: float, most: float = 1.0) -> float:
        """The bending after a way, from -most to most."""
        end = math.copysign(most, way)
        self.bend = end + (self.bend - end) * math.exp(-abs(way) / (self._length * most))
        return self.bend


def dahl() -> Contact:
    """One length of bristles."""
    bristles = Bent(0.008)
    return lambda t, x, v, h: -0.3 * bristles.move(v * h)


def overshooting() -> Contact:
    """Short bristles that push and long ones that give way."""
    short, long = Bent(0.004), Bent(0.016)
    return lambda t, x, v, h: -1.0 * short.move(v * h) + 0.5 * long.move(v * h)


def held_at_rest() -> Contact:
    """Bristles that bend further the slower they slide."""
    bristles = Bent(0.004)
    return lambda t, x, v, h: -0.5 * bristles.move(v * h, 1 + 0.8 * math.exp(-((v / 0.07) ** 2)))


def binding() -> Contact:
    """Bristles that are pressed the more the further from a place."""
    bristles = Bent(0.004)
    return lambda t, x, v, h: -7.0 * abs(x - 0.02) * bristles.move(v * h)


def binding_on(side: float) -> Contact:
    """Bristles that touch on one side of a place only: above it for 1, below it for -1."""
    bristles = Bent(0.004)
    return lambda t, x, v, h: (
        -0.4 * (1 + math.tanh(side * (x - 0.02) / 0.01)) * bristles.move(v * h)
    )


class Yielding:
    """A joint that yields gradually, and unloads along a straight line."""

    def __init__(self, way: float, force: float, sharpness: float) -> None:
        self._way, self._force, self._sharp, self._share = way, force, sharpness, 0.0

    def __call__(self, _t: float, _x: float, v: float, h: float) -> float:
        """The joint's force."""
        loads = v * self._share > 0
        slope = 1 - abs(self._share) ** self._sharp if loads else 1.0
        self._share = max(-1.0, min(1.0, self._share + v * h / self._way * slope))
        return -self._force * self._share


PRESLIDING: dict[str, Callable[[], Contact]] = {
    "jenkins": lambda: SlipElement(0.02, 0.8),
    "elastoplastic": lambda: SlipElement(0.012, 0.6, more=0.8),
    "jenkins_running_in": lambda: SlipElement(0.02, 0.5, settles=1.5),
    "elastoplastic_running_in": lambda: SlipElement(0.012, 0.4, more=0.8, settles=1.5),
    "bouc_wen": lambda: Yielding(0.06, 1.0, 2.0),
    "dahl": dahl,
    "bliman_sorine_1": dahl,
    "bliman_sorine_2": overshooting,
    "lugre": held_at_rest,
    "binding_with_memory": binding,
    "binding_past_with_memory": lambda: binding_on(1.0),
    "binding_before_with_memory": lambda: binding_on(-1.0),
}
"""By the effect that describes them."""

# ruff: noqa: ARG005 -- laws of one kind take the same arguments
"""Springs, stops and slides at the mass: forces that follow from position and direction at once.

Symbols: t time [s], x position [m], v velocity [m/s], h step [s]; forces in N.
"""

import math
from collections.abc import Callable

Contact = Callable[[float, float, float, float], float]
"""Time, position, velocity and step → force."""

STIFFNESS = 60.0
"""Of the mass's spring [N/m]."""
GAP, STOP = 0.03, 0.1
"""Half the play of a spring, and the travel to a stop [m]."""


def _rubbing(holds: Callable[[float], float]) -> Callable[[], Contact]:
    """A slide whose dry friction depends on the place, given as a force by position."""
    return lambda: lambda t, x, v, h: -math.copysign(holds(x), v)


def _beyond(x: float, travel: float) -> float:
    """How far a position is outside a travel either way."""
    return math.copysign(max(abs(x) - travel, 0.0), x)


def _dent(x: float) -> float:
    """Friction over a dent with soft edges."""
    off = (x - 0.06) / 0.07
    return 0.5 * math.cos(math.pi / 2 * off) ** 2 if abs(off) < 1 else 0.0


def _worn(x: float) -> float:
    """Friction either side of a stretch that is worn free."""
    return 0.3 / (1 + (0.04 / max(abs(x - 0.03), 1e-6)) ** 4)


class RunningIn:
    """Dry friction that falls along the path slid."""

    def __init__(self) -> None:
        self._path = 0.0

    def __call__(self, _t: float, _x: float, v: float, h: float) -> float:
        """The friction."""
        self._path += abs(v) * h
        return -math.copysign(0.3 + 0.6 * math.exp(-self._path / 0.8), v)


SPRINGS: dict[str, Callable[[], Contact]] = {
    "backlash": lambda: lambda t, x, v, h: STIFFNESS * (x - _beyond(x, GAP)),
    "cubic_stiffness": lambda: lambda t, x, v, h: -900.0 * x**3,
    "cubic_stiffness_off_middle": lambda: lambda t, x, v, h: -900.0 * (x - 0.06) ** 3,
    "quadratic_stiffness": lambda: lambda t, x, v, h: -60.0 * x * x,
    "hard_stop": lambda: lambda t, x, v, h: -90.0 * _beyond(x, STOP),
    "constant_force": lambda: lambda t, x, v, h: 0.6,
    "periodic_force": lambda: lambda t, x, v, h: 0.6 * math.cos(2 * math.pi * x / 0.09),
}
SLIDES: dict[str, Callable[[], Contact]] = {
    "coulomb": _rubbing(lambda x: 0.4),
    "stribeck": lambda: lambda t, x, v, h: -math.copysign(0.8, v) * math.exp(-((v / 0.09) ** 2)),
    "quadratic_drag": lambda: lambda t, x, v, h: -1.2 * v * abs(v),
    "viscous_by_direction": lambda: lambda t, x, v, h: -1.0 * v if v > 0 else 0.0,
    "coulomb_by_direction": lambda: lambda t, x, v, h: -0.6 if v > 0 else 0.25,
    "position_dependent": _rubbing(lambda x: max(0.5 + 2.5 * x, 0.0)),
    "binding": _rubbing(lambda x: 5.0 * abs(x)),
    "binding_above": _rubbing(lambda x: 10.0 * max(x - 0.02, 0.0)),
    "binding_below": _rubbing(lambda x: 10.0 * max(-0.02 - x, 0.0)),
    "binding_past": _rubbing(lambda x: 0.8 if x > 0.05 else 0.0),
    "binding_before": _rubbing(lambda x: 0.8 if x < -0.05 else 0.0),
    "binding_outside": _rubbing(_worn),
    "binding_off_middle": _rubbing(lambda x: 5.0 * abs(x - 0.035)),
    "local_binding": _rubbing(_dent),
    "end_binding": _rubbing(lambda x: 2.0 * (x / 0.2) ** 4),
    "coulomb_running_in": RunningIn,
}

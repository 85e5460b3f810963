"""One colour per quantity, in plots, tests and manual, chosen for a dark background.

Colours are (red, green, blue) from 0 to 255. Measured quantities are warm or saturated, modelled
ones pale, limits red.
"""

from rigwatch.wire.messages import AlarmState

Colour = tuple[int, int, int]

VOLTAGE: Colour = (88, 160, 255)
POSITION: Colour = (76, 205, 140)
ACCELERATION: Colour = (255, 165, 60)
MODEL: Colour = (196, 150, 255)
RESIDUAL: Colour = (120, 116, 84)
CHANGE: Colour = (232, 208, 56)
THETA1: Colour = (255, 110, 190)
THETA2: Colour = (70, 205, 220)
LIMIT: Colour = (235, 75, 75)
SIGNATURE: Colour = (186, 194, 206)
DEVIATION: Colour = (255, 140, 105)
VELOCITY: Colour = (120, 215, 175)
OTHERS: tuple[Colour, ...] = (
    (90, 160, 240),
    (240, 160, 70),
    (90, 200, 140),
    (230, 110, 170),
    (190, 150, 250),
    (225, 205, 70),
    (80, 200, 215),
    (235, 100, 90),
)
"""Colours of channels and counters that have none of their own."""

STATES: dict[AlarmState, tuple[str, Colour]] = {
    "normal": ("normal", (38, 92, 62)),
    "unacknowledged": ("ALARM", (226, 54, 54)),
    "acknowledged": ("alarm, acknowledged", (214, 124, 36)),
    "cleared_unacknowledged": ("cleared, not acknowledged", (150, 110, 30)),
}
"""Label and colour of each alarm state."""


_ALARM: Colour = STATES["unacknowledged"][1]
VERDICTS: dict[str, tuple[str, Colour]] = {
    "waiting": ("no estimates yet", (70, 70, 78)),
    "learning": ("learning the healthy reference", (60, 90, 130)),
    "healthy": ("healthy", (36, 140, 84)),
    "no_verdict": ("no verdict", (84, 92, 110)),
    "over": ("cleared, not acknowledged", (150, 110, 30)),
    "departure": ("departure from the model", (220, 120, 30)),
    "dry_friction": ("DRY FRICTION", _ALARM),
    "stiction": ("STICTION", (200, 40, 110)),
    "other_fault": ("OTHER FAULT", (190, 70, 30)),
    "link": ("NOT CONNECTED", (120, 60, 150)),
    "stale": ("NO SAMPLES", (120, 60, 150)),
    "unwatched": ("NOT WATCHED", (120, 60, 150)),
    "fault": ("FAULT", (200, 80, 60)),
}
"""Label and colour of each verdict on the rig."""


def rgba(colour: Colour) -> int:
    """The colour as 0xRRGGBBAA, opaque."""
    red, green, blue = colour
    return red << 24 | green << 16 | blue << 8 | 0xFF

"""What a wiring check finds, by the name of its alarm: for the monitor, its model and operators."""

from typing import Literal, get_args

Wiring = Literal["wiring_sign", "wiring_scale", "wiring_swapped", "wiring_drive"]
WIRING: tuple[Wiring, ...] = get_args(Wiring)

"""Wiring check at the start: whether position and acceleration show one and the same motion."""

from monitor.wiring.wiring_check import WIRING, WiringCheck

__all__ = ["WIRING", "WiringCheck"]

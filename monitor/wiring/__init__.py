"""Wiring check: whether position and acceleration show one and the same motion, as the drive asks.

At the monitor's start (`WiringCheck`), and of recordings that a model is made of.
"""

from monitor.wiring.recorded_wiring import recorded_wiring
from monitor.wiring.wiring_check import DRIVE, DRIVE_GAIN, FAILURES, WiringCheck, window_samples

__all__ = ["DRIVE", "DRIVE_GAIN", "FAILURES", "WiringCheck", "recorded_wiring", "window_samples"]

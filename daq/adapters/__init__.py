"""Adapters: the devices that samples are read from, found by name through entry points.

Serial lines may also be read together with others (`daq.together`).
"""

from daq.adapters.frame_run import most_frames, read_frames
from daq.adapters.registry import adapter_for, known
from daq.adapters.serial_line import SerialAdapter

__all__ = ["SerialAdapter", "adapter_for", "known", "most_frames", "read_frames"]

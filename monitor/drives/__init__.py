"""What the generator of an input does, from the input alone: new frequencies, steps that slide or
jitter.
"""

from monitor.drives.drive_changes import Drive, DriveChanges
from monitor.drives.input_steps import InputSteps, Steps
from monitor.drives.jittered_edges import JitteredEdges
from monitor.drives.jittered_steps import Jittered, JitteredSteps
from monitor.drives.sliding_steps import Sliding, SlidingSteps

__all__ = [
    "Drive",
    "DriveChanges",
    "InputSteps",
    "Jittered",
    "JitteredEdges",
    "JitteredSteps",
    "Sliding",
    "SlidingSteps",
    "Steps",
]

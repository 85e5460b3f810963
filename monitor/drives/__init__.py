"""What the generator of an input does, from the input: new frequencies, stops, steps that slide,
jitter or are held, and edges between samples, where the motion has to tell.
"""

from monitor.drives.bridged_edges import BridgedEdges
from monitor.drives.drive_changes import Drive, DriveChanges
from monitor.drives.drive_stops import DriveStops
from monitor.drives.edge_choice import corrected, edges_unsure, follow_edges, no_edges, undecided
from monitor.drives.held_readings import HeldReadings
from monitor.drives.input_steps import InputSteps, Steps
from monitor.drives.jittered_edges import JitteredEdges
from monitor.drives.jittered_steps import Jittered, JitteredSteps
from monitor.drives.read_instants import follow_instants, no_instants, still_unsure
from monitor.drives.recorded_drives import (
    DriveBands,
    RecordedDrives,
    same_drive,
    steady_energies,
)
from monitor.drives.sliding_edges import Moved, SlidingEdges
from monitor.drives.sliding_steps import Sliding, SlidingSteps

__all__ = [
    "BridgedEdges",
    "Drive",
    "DriveBands",
    "DriveChanges",
    "DriveStops",
    "HeldReadings",
    "InputSteps",
    "Jittered",
    "JitteredEdges",
    "JitteredSteps",
    "Moved",
    "RecordedDrives",
    "Sliding",
    "SlidingEdges",
    "SlidingSteps",
    "Steps",
    "corrected",
    "edges_unsure",
    "follow_edges",
    "follow_instants",
    "no_edges",
    "no_instants",
    "same_drive",
    "steady_energies",
    "still_unsure",
    "undecided",
]

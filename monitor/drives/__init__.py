"""What the generator of an input does, from the input alone: new frequencies, sliding steps."""

from monitor.drives.drive_changes import Drive, DriveChanges
from monitor.drives.sliding_steps import Sliding, SlidingSteps

__all__ = ["Drive", "DriveChanges", "Sliding", "SlidingSteps"]

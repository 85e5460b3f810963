"""The demonstration: a simulated rig on a real serial line, from commissioning to a named fault.

rig_file.py      the rig's configuration with everything it writes in one folder
commissioning.py recordings of the simulated rig, and the monitor's model made from them
narrator.py      what happens, in plain words, as it happens
verdict.py       whether the fault was found and named, and whether the recording is whole
"""

from rigwatch.demo.commissioning import ensure_model
from rigwatch.demo.rig_file import forget_alarms, write_rig_file
from rigwatch.demo.show import Show

__all__ = ["Show", "ensure_model", "forget_alarms", "write_rig_file"]

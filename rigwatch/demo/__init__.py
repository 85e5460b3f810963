"""The demonstration: a simulated rig on a real serial line, from commissioning to a named fault.

own_folder.py    a folder that no other demonstration uses
rig_file.py      the rig's configuration with everything it writes in one folder
commissioning.py recordings of the simulated rig, and the monitor's model made from them
narrator.py      live narration of events
workbench_pages.py  the workbench in a browser beside it
verdict.py       whether the fault was detected and named, and whether the recording is complete
"""

from rigwatch.demo.commissioning import ensure_model
from rigwatch.demo.own_folder import own_folder
from rigwatch.demo.rig_file import forget_alarms, write_rig_file
from rigwatch.demo.show import Show
from rigwatch.demo.workbench_pages import Pages, workbench_pages

__all__ = [
    "Pages",
    "Show",
    "ensure_model",
    "forget_alarms",
    "own_folder",
    "workbench_pages",
    "write_rig_file",
]

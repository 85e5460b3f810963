"""The monitor as a process: its loop, its persistent state, and supervision of the link.

    bus ──samples──▶ RigMonitor.update ──estimates, alarms──▶ bus

The cursor survives a kill, `model_requests` applies model changes between two samples,
`link_watch` detects silence and losses, `startup_grace` gives other processes time to start, and
`several` runs the monitors of several rigs in one process.
"""

from monitor.process.cursor import stored_position
from monitor.process.loop import monitor_section, run, suitable_model
from monitor.process.several import run_several

__all__ = ["monitor_section", "run", "run_several", "stored_position", "suitable_model"]

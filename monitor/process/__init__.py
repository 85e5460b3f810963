"""The monitor as a process: its loop, what it remembers and what it watches besides samples.

    bus ──samples──▶ RigMonitor.update ──estimates, alarms──▶ bus

The cursor survives a kill, `model_requests` applies model changes between two samples,
`link_watch` notices silence and losses, and `startup_grace` gives other processes time to
start.
"""

from monitor.process.loop import monitor_section, run

__all__ = ["monitor_section", "run"]

"""Starts the processes of a rig, monitors them, and restarts those that die or hang.

plan.py        which processes a configuration asks for, and whose samples each uses
several.py     the same for several rigs
vitals.py      what a process has reported, and when it counts as hung
processor_time.py  whether a process that passes no samples on only waits for a processor
child.py       one process: start, notifications, output, end
supervisor.py  all processes: restart with back-off, status, orderly stop
config_watch.py  a change of the configuration restarts what it concerns
rig_set.py     rigs and processes join and leave with their files and sections
console.py     events and status as lines
own_heartbeat.py  what the supervisor reports to its own parent
"""

from rigwatch.supervisor.config_watch import ConfigWatch
from rigwatch.supervisor.console import Console, Flow
from rigwatch.supervisor.own_heartbeat import OwnHeartbeat
from rigwatch.supervisor.plan import PROCESSES, ProcessPlan, plan
from rigwatch.supervisor.rig_set import RigSet, planned
from rigwatch.supervisor.several import plan_several
from rigwatch.supervisor.supervisor import Supervisor

__all__ = [
    "PROCESSES",
    "ConfigWatch",
    "Console",
    "Flow",
    "OwnHeartbeat",
    "ProcessPlan",
    "RigSet",
    "Supervisor",
    "plan",
    "plan_several",
    "planned",
]

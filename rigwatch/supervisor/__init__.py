"""Starts the processes of a rig, watches them, and starts again those that die or hang.

plan.py        which processes a configuration asks for, and whose samples each works on
vitals.py      what a process has said, and when that means that it hangs
child.py       one process: start, words, output, end
supervisor.py  all of them: restart with back-off, status, orderly stop
"""

from rigwatch.supervisor.console import Console, Flow
from rigwatch.supervisor.plan import PROCESSES, plan
from rigwatch.supervisor.supervisor import Supervisor

__all__ = ["PROCESSES", "Console", "Flow", "Supervisor", "plan"]

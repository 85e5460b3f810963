"""Checks an installation, this machine and a rig's configuration, and suggests remedies.

finding.py   one result: ok, warn or fail, with a remedy
machine.py   Python, packages, compiled kernels, clock, scheduling, disk
viewer.py    how the dashboard can be displayed
rig.py       a configuration: the files it names, ports, device
kept*.py     the files that processes keep: read as they read them, and mended
"""

from rigwatch.doctor.alive import check_alive
from rigwatch.doctor.finding import Finding
from rigwatch.doctor.machine import check_machine
from rigwatch.doctor.rig import check_rig
from rigwatch.doctor.viewer import check_viewer

__all__ = ["Finding", "check_alive", "check_machine", "check_rig", "check_viewer"]

"""Checks an installation, this machine and a rig's configuration, and says what to do.

finding.py   one result: ok, warn or fail, with a remedy
machine.py   Python, packages, compiled kernels, clock, scheduling, disk
viewer.py    what the dashboard can be shown with
rig.py       a configuration: files it names, ports, device
"""

"""The witness: not the monitor, it says when the monitor is stale, and notifies people.

bus ──estimates, alarms──▶ Witness ──▶ alarm `monitor_stale`, heartbeat file, notifications
"""

from rigwatch.witness.process import run

__all__ = ["run"]

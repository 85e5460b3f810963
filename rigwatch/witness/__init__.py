"""The witness: supervises the monitor from a separate process and sends notifications.

bus ──estimates, alarms──▶ Witness ──▶ alarm `monitor_stale`, heartbeats, notifications
"""

from rigwatch.witness.process import run

__all__ = ["run"]

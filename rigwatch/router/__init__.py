"""The router of a rig as a process; it counts who is refused, and with keys follows the register.

register.json ──changed──▶ Zenoh's router is opened again with the new access list
Zenoh's log ──▶ RefusalLog ──▶ health, event `ACCESS REFUSED`
"""

from rigwatch.router.process import run
from rigwatch.router.refusal_log import RefusalLog

__all__ = ["RefusalLog", "run"]

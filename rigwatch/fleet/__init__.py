"""The state of many rigs at a glance, the worst first.

`Fleet` looks at the rigs of several configurations, on one router or on several, each in a thread
of its own: a rig that does not answer delays none.
"""

from rigwatch.fleet.dashboards import Dashboards
from rigwatch.fleet.fleet import Fleet
from rigwatch.fleet.overview import as_lines, as_live_page, as_page, as_part, summary
from rigwatch.fleet.rig_state import RigState

__all__ = [
    "Dashboards",
    "Fleet",
    "RigState",
    "as_lines",
    "as_live_page",
    "as_page",
    "as_part",
    "summary",
]

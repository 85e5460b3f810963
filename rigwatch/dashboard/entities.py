"""Names in the viewer that more than one module here speaks of: the timeline, entities, titles."""

TIMELINE = "time"

STATUS = "status"
WAITING = "waiting"
STATES = "rig"
"""The verdict's lane; a lane an alarm stands below it."""
LOG = "alarms"
EVENTS = "events"
HEALTH = "health"

VERDICT_VIEW = "Verdict"
ALARMS_VIEW = "Verdict and alarms over time"
LOG_VIEW = "Alarm log: what happened, what to do"
EVENTS_VIEW = "Events and gaps"
HEALTH_VIEWS = {"rates": "Rates [Hz]", "latency": "Times [ms]", "counts": "Counts since start"}

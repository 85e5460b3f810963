"""Names in the viewer that several modules share: the timeline, entities, titles."""

TIMELINE = "time"

ADVICE = "advice"
STATUS = "status"
WAITING = "waiting"
VERDICT = "verdict"
LANES = "rig"
LOG = "alarms"
EVENTS = "events"
HEALTH = "health"

VERDICT_VIEW = "Verdict"
ADVICE_VIEW = "What to do"
STATUS_VIEW = "Status"
ALARMS_VIEW = "Alarms over time"
LOG_VIEW = "Alarm log"
EVENTS_VIEW = "Events and gaps"
HEALTH_VIEWS = {
    "rates": "Rates [Hz]",
    "times": "Times [ms]",
    "losses": "Losses and errors since start",
    "clock": "Clock of the device [ppm]",
    "volumes": "Volumes since start",
}

"""What leaves a recording's folder by its age and size, and by which time ages count.

    AgeClock ──time──▶ Retention removes old segments
                 └───▶ Thinning starts processes that thin old sessions

`rules` say which recordings go, here and in archives.
"""

from rigwatch.recorder.retention.age_clock import EARLIEST_NS, AgeClock, clock_of
from rigwatch.recorder.retention.removal import Retention
from rigwatch.recorder.retention.rules import DAY, expired
from rigwatch.recorder.retention.thinning import Thinning

__all__ = ["DAY", "EARLIEST_NS", "AgeClock", "Retention", "Thinning", "clock_of", "expired"]

"""What a subscriber takes of the alarms that are said: of each process a share, and none twice."""

from rigwatch.wire.bus.alarms.retold import Retold
from rigwatch.wire.bus.alarms.shares import AlarmShares

__all__ = ["AlarmShares", "Retold"]

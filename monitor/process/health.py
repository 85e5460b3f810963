"""The monitor's own health message, once a second: samples, losses, queue, latency."""

import math
from collections import deque
from collections.abc import Sequence
from statistics import median

from rigwatch.wire.delivery import Counters
from rigwatch.wire.messages import Health

LATENCIES_KEPT = 1024
INTERVAL_NS = 1_000_000_000


class HealthBook:
    """Collects figures for the health message.

    Args:
        source: name of the sender, such as "monitor".
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self._latency_ms: deque[float] = deque(maxlen=LATENCIES_KEPT)
        self._said_ns = 0

    def judged(self, sample_ns: int, now_ns: int) -> None:
        """Record that estimates of a sample taken at `sample_ns` are published at `now_ns` [ns]."""
        self._latency_ms.append((now_ns - sample_ns) / 1e6)

    def judged_after(self, latencies_ms: list[float]) -> None:
        """The same of several samples, by the time from each to its estimates [ms]."""
        self._latency_ms.extend(latencies_ms)

    def will_be_due(self, now_ns: int) -> bool:
        """Whether the next message is due at this moment [ns]."""
        return now_ns - self._said_ns >= INTERVAL_NS

    def is_due(self, now_ns: int) -> bool:
        """Whether a second has passed since the last message; `now_ns` is monotonic [ns]."""
        if not self.will_be_due(now_ns):
            return False
        self._said_ns = now_ns
        return True

    def message(
        self, t_ns: int, state: str, text: str, counters: Counters, extra: dict[str, float]
    ) -> Health:
        """The current health message."""
        latencies = sorted(self._latency_ms) or [math.nan]
        self._latency_ms.clear()
        figures = {
            "samples": float(counters.delivered),
            "lost_samples": float(counters.lost),
            "recovered_samples": float(counters.recovered),
            "duplicate_samples": float(counters.duplicates),
            "foreign_samples": float(counters.foreign),
            **extra,
            "latency_ms": median(latencies),
            "latency_p99_ms": at_share(latencies, 0.99),
            "latency_worst_ms": latencies[-1],
        }
        return Health(self._source, t_ns, state, text, figures)


def at_share(ordered: Sequence[float], share: float) -> float:
    """What a share of some numbers does not exceed, between two of them by a straight line.

    NumPy's quantile of a few numbers takes as long as to judge several blocks of samples.

    Args:
        ordered: at least one number, in rising order.
        share: from 0 to 1.
    """
    place = share * (len(ordered) - 1)
    below = int(place)
    low, high = ordered[below], ordered[min(below + 1, len(ordered) - 1)]
    return low + (high - low) * (place - below)

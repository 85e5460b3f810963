"""The monitor's own health message, once a second: samples, losses, queue, latency."""

from collections import deque

import numpy as np

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

    def is_due(self, now_ns: int) -> bool:
        """Whether a second has passed since the last message; `now_ns` is monotonic [ns]."""
        if now_ns - self._said_ns < INTERVAL_NS:
            return False
        self._said_ns = now_ns
        return True

    def message(
        self, t_ns: int, state: str, text: str, counters: Counters, extra: dict[str, float]
    ) -> Health:
        """The current health message."""
        latencies = np.array(self._latency_ms) if self._latency_ms else np.full(1, np.nan)
        self._latency_ms.clear()
        figures = {
            "samples": float(counters.delivered),
            "lost_samples": float(counters.lost),
            "recovered_samples": float(counters.recovered),
            "duplicate_samples": float(counters.duplicates),
            "foreign_samples": float(counters.foreign),
            **extra,
            "latency_ms": float(np.median(latencies)),
            "latency_p99_ms": float(np.percentile(latencies, 99)),
            "latency_worst_ms": float(np.max(latencies)),
        }
        return Health(self._source, t_ns, state, text, figures)

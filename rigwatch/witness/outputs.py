"""Outputs for other watchdogs: heartbeat file, ping of a URL, Prometheus endpoint."""

from pathlib import Path

from rigwatch.wire.bus import Bus
from rigwatch.wire.messages import HEALTH
from rigwatch.wire.rig_config import SecuritySection, WitnessSection
from rigwatch.witness.beats import Pinger, write_beat
from rigwatch.witness.metrics import Endpoint, Figures


class Outputs:
    """The outputs that the section [witness] names.

    Args:
        settings: section [witness].
        bus: source of the figures.
        security: section [bus.security].

    Attributes:
        figures: what the endpoint serves.

    Raises:
        ConfigError: an output is invalid.
        MissingExtraError: the package for the endpoint is not installed.
    """

    def __init__(self, settings: WitnessSection, bus: Bus, security: SecuritySection) -> None:
        self.figures = Figures(bus.rig)
        self._file_trouble = ""
        self._file = Path(settings.heartbeat_file) if settings.heartbeat_file else None
        url, seconds = settings.heartbeat_url, settings.heartbeat_seconds
        self._pinger = Pinger(url, seconds) if url else None
        metrics = settings.metrics
        self._endpoint = Endpoint(metrics, self.figures, security) if metrics else None
        self._healths = bus.subscribe(HEALTH) if metrics else None

    @property
    def trouble(self) -> str:
        """Why an output is not renewed, in one line; "" if all are."""
        return self._file_trouble or (self._pinger.trouble if self._pinger else "")

    @property
    def counters(self) -> dict[str, float]:
        """Figures for the health message."""
        if self._pinger is None:
            return {}
        return {"pings_sent": float(self._pinger.sent), "pings_failed": float(self._pinger.failed)}

    def renew(self, now: float, t_ns: int, silent: float, *, stale: bool) -> None:
        """Renew the outputs, about once a second; the heartbeats only while estimates come.

        Args:
            now: monotonic time [s].
            t_ns: Unix time [ns].
            silent: time since the last estimate [s].
            stale: whether that is long enough for the alarm `monitor_stale`.
        """
        self.figures.advance(now, silent)
        for health in self._healths.drain() if self._healths else ():
            self.figures.take_health(health, now)
        if not stale and self._file:
            self._file_trouble = write_beat(self._file, self.figures.rig, t_ns)
        if not stale and self._pinger:
            self._pinger.beat(now)

    def close(self) -> None:
        """Stop serving."""
        if self._endpoint:
            self._endpoint.close()

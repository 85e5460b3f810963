"""A Prometheus endpoint: what the witness knows of the rig, as figures to collect."""

import logging
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.wire.access import authority_file, key_files
from rigwatch.wire.errors import ConfigError, MissingExtraError, RigwatchError, reason_of
from rigwatch.wire.messages import MOST_FIGURES, Alarm, Health, is_remembered, remember
from rigwatch.wire.rig_config import SecuritySection

if TYPE_CHECKING:
    from prometheus_client.core import Metric

_log = logging.getLogger(__name__)
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
ALIVE_S = 5.0
"""Age of a health message up to which its process counts as alive [s]."""


class Figures:
    """What is known of the rig; filled by the witness, read by the endpoint's threads.

    Args:
        rig: id of the rig.
    """

    def __init__(self, rig: str) -> None:
        self.rig = rig
        self.monitor_age_s = float("nan")
        self._alarms: dict[str, Alarm] = {}
        self._health: dict[str, tuple[Health, float]] = {}
        self._now = 0.0
        self._lock = threading.Lock()

    def advance(self, now: float, monitor_age_s: float) -> None:
        """Set monotonic time and the time since the last estimate [s]."""
        with self._lock:
            self._now, self.monitor_age_s = now, monitor_age_s

    def take_alarm(self, alarm: Alarm) -> None:
        """Take note of an alarm."""
        with self._lock:
            remember(self._alarms, alarm)

    def take_health(self, health: Health, now: float) -> None:
        """Take note of a health message received at `now` [s]."""
        with self._lock:
            if is_remembered(self._health, health.source):
                self._health[health.source] = health, now

    def collect(self) -> Iterator["Metric"]:
        """The figures, as Prometheus' library asks for them."""
        from prometheus_client.core import GaugeMetricFamily

        with self._lock:
            alarms, healths = list(self._alarms.values()), dict(self._health)
            now, age = self._now, self.monitor_age_s
        yield _single(
            "rigwatch_monitor_age_seconds", "Time since the last estimate.", self.rig, age
        )
        standing = GaugeMetricFamily(
            "rigwatch_alarms", "Alarms by state and severity.", labels=("rig", "state", "severity")
        )
        for (state, severity), count in Counter((a.state, a.severity) for a in alarms).items():
            standing.add_metric((self.rig, state, severity), count)
        yield standing
        alive = GaugeMetricFamily(
            "rigwatch_process_up", "Whether a process reports.", labels=("rig", "process")
        )
        figures = GaugeMetricFamily(
            "rigwatch_figure",
            "Figures of the health messages: rates, losses, latency, disk.",
            labels=("rig", "process", "figure"),
        )
        for source, (health, at) in healths.items():
            alive.add_metric((self.rig, source), float(now - at <= ALIVE_S))
            for name, value in list(health.counters.items())[:MOST_FIGURES]:
                figures.add_metric((self.rig, source, name), value)
        yield alive
        yield figures


def _single(name: str, text: str, rig: str, value: float) -> "Metric":
    from prometheus_client.core import GaugeMetricFamily

    family = GaugeMetricFamily(name, text, labels=("rig",))
    family.add_metric((rig,), value)
    return family


class Endpoint:
    """Serves the figures over HTTP; on other addresses than loopback over mutual TLS only.

    Args:
        address: such as 127.0.0.1:9464.
        figures: what is served.
        security: section [bus.security].

    Raises:
        ConfigError: the address is malformed, or not loopback although there are no keys.
        MissingExtraError: prometheus-client is not installed.
        RigwatchError: the address is taken.
    """

    def __init__(self, address: str, figures: Figures, security: SecuritySection) -> None:
        try:
            from prometheus_client import CollectorRegistry, start_http_server
        except ImportError:
            raise MissingExtraError(
                "prometheus-client", "notify", "the endpoint witness.metrics"
            ) from None
        host, port = _host_and_port(address)
        registry = CollectorRegistry()
        registry.register(figures)
        try:
            self._server, self._thread = start_http_server(
                port, host, registry, **_tls(host, address, security)
            )
        except OSError as error:
            text = f"cannot listen at {address}: {reason_of(error)}"
            raise RigwatchError(f"witness.metrics: {text}") from None
        self._server.handle_error = _not_answered  # type: ignore[assignment,method-assign]

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()


def _not_answered(_request: object, client: object) -> None:
    """Log in one line that a request ended with an error; that clients go away is none."""
    if not isinstance(error := sys.exc_info()[1], ConnectionError):
        _log.warning("witness.metrics: a request of %s ended: %s", client, error)


def _host_and_port(address: str) -> tuple[str, int]:
    host, _, port = address.rpartition(":")
    if not host or not port.isdigit() or int(port) > 65535:
        expected = "host and port such as 127.0.0.1:9464"
        raise ConfigError("configuration", "witness.metrics", address, expected)
    return host.strip("[]"), int(port)


def _tls(host: str, address: str, security: SecuritySection) -> dict[str, Any]:
    if host in _LOOPBACK:
        return {}
    if not security.keys:
        expected = "a loopback address, or keys in bus.security.keys (`rigwatch keys new`)"
        raise ConfigError("configuration", "witness.metrics", f"{address} without keys", expected)
    folder = Path(security.keys)
    public, private = key_files(folder, "witness")
    return {
        "certfile": str(public),
        "keyfile": str(private),
        "client_cafile": str(authority_file(folder)),
        "client_auth_required": True,
    }

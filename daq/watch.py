"""Device health: rates, silence, quality and plausibility, published as health and events.

`state` is the first of these that applies:

    reconnecting   the device is not open, or reopened and nothing has arrived yet
    garbage        more than 1 % of the bytes of the last second belong to no frame
    two devices    another device sends on the same line
    starting       open, nothing has arrived yet
    stale          no sample for `stale_after`
    slow           fewer than 90 % of the nominal rate over the last hundred samples
    running
"""

from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from rigwatch.wire.messages import Event, Health, Message, SampleBlock, Severity
from rigwatch.wire.messages import quality_flags as quality

_SECOND = 1_000_000_000
_SLOW = 0.9
_SLOW_OVER = 100
_GARBAGE = 0.01
_DRIFT_LIMITS: tuple[tuple[float, Severity], ...] = ((5000.0, "error"), (500.0, "warning"))
_PLAUSIBLE_AFTER_S, _PLAUSIBLE_LEAST = 0.75, 64
"""Time and fewest samples after which plausibility is judged: told within the first second."""
_STATE_EVENTS: dict[str, tuple[Severity, str]] = {
    "reconnecting": ("error", "link_lost"),
    "garbage": ("error", "garbage"),
    "two devices": ("error", "two_devices"),
    "stale": ("error", "stale"),
    "slow": ("warning", "slow"),
    "running": ("info", "running"),
}


@dataclass(frozen=True, slots=True)
class Link:
    """The connection: whether it is up, its problem, and the number of reconnections."""

    connected: bool
    text: str = ""
    reconnects: int = 0
    trouble: str = ""


OPEN = Link(True)
"""That of a device that is open and in order."""


class Watch:
    """Monitors the stream of one device.

    Args:
        source: name of the sender, such as "daq/rig".
        rate: nominal sample rate [Hz].
        stale_after: silence after which the device counts as stale [s].
        clock_rate: how much faster than real time a replay runs.
    """

    def __init__(
        self, source: str, rate: float, stale_after: float, clock_rate: float = 1.0
    ) -> None:
        self.state = "starting"
        self._text = ""
        self._source = source
        self._rate = rate
        self._clock_rate = clock_rate
        self._stale_ns = round(stale_after * _SECOND)
        self._flagged: Counter[str] = Counter()
        self._recent: deque[tuple[int, int]] = deque(maxlen=_SLOW_OVER + 1)
        self._boot: int | None = None
        self._samples, self._first_samples, self._second_samples = 0, 0, 0
        self._first_ns: int | None = None
        self._last_ns: int | None = None
        self._second_ns: int | None = None
        self._rates = {"rate_hz": 0.0, "rate_mean_hz": 0.0, "rate_worst_hz": 0.0}
        self._before: dict[str, float] = {}
        self._line_trouble: tuple[str, str] | None = None
        self._polls_failed = 0.0
        self._failure_told_ns = -_SECOND
        self._drift_severity: Severity = "info"
        self._outside: dict[str, int] = {}

    def saw(self, block: SampleBlock, arrived_ns: int, unix_minus_monotonic_ns: int) -> None:
        """Count published samples, whose Unix time has this difference to the monotonic clock."""
        last_ns = int(block.t_ns[-1]) - unix_minus_monotonic_ns
        self.saw_run(block.boot, block.seq + len(block) - 1, len(block), last_ns, arrived_ns)
        for column in block.channels:
            self.count_flags(column.name, column.quality)

    def saw_run(self, boot: int, last: int, count: int, last_ns: int, arrived_ns: int) -> None:
        """Count published samples without flags.

        Args:
            boot: theirs.
            last: number of the last one.
            count: of them.
            last_ns: the last one's time on the monotonic clock: Unix time that is set forward would
                look like a pause [ns].
            arrived_ns: when the last one arrived [ns].
        """
        if self._first_ns is None:
            self._first_ns, self._first_samples = arrived_ns, count
        self._last_ns = arrived_ns
        if boot != self._boot:
            self._boot = boot
            self._recent.clear()
        self._recent.append((last, last_ns))
        self._samples += count

    def tick_quietly(self, now_ns: int) -> bool:
        """`tick` of a device that is open, its line in order; False if there is more to do."""
        if self._second_ns is None or now_ns - self._second_ns >= _SECOND:
            return False
        if not self._outside.get("", 0) or self._judge(now_ns, OPEN)[0] != self.state:
            return False
        self._forget_old()
        return True

    def silent_in(self, now_ns: int) -> float:
        """Time until the device counts as stale [s], at least a millisecond."""
        if self._last_ns is None or self.state == "stale":
            return 0.05
        return float(min(max((self._last_ns + self._stale_ns - now_ns) / _SECOND, 1e-3), 0.05))

    def tick(
        self, now_ns: int, unix_ns: int, link: Link, counters: Mapping[str, float]
    ) -> list[Message]:
        """Events for what changed; health once a second and when the state changes."""
        messages: list[Message] = [
            *self._failed_polls(unix_ns, link, counters),
            *self._implausible(unix_ns),
        ]
        second_over = self._second_ns is None or now_ns - self._second_ns >= _SECOND
        if second_over:
            messages += self._second(now_ns, unix_ns, counters)
        state, text = self._judge(now_ns, link)
        if state in {"slow", "running"}:
            self._forget_old()
        if state != self.state or (state == "reconnecting" and text != self._text):
            messages += self._changed(state, text, unix_ns)
        if second_over or messages:
            messages.append(self._health(now_ns, unix_ns, text, link, counters))
        return messages

    def _judge(self, now_ns: int, link: Link) -> tuple[str, str]:
        if not link.connected or link.text:
            return "reconnecting", link.text
        if self._line_trouble:
            return self._line_trouble
        if self._last_ns is None:
            return "starting", "nothing has come from the device yet"
        silence = now_ns - self._last_ns
        if silence >= self._stale_ns:
            return "stale", f"no sample for {silence / _SECOND:.1f} s"
        rate = self._recent_rate()
        if rate < _SLOW * self._rate:
            return "slow", f"{rate:.0f} samples a second, expected {self._rate:.0f}"
        return "running", ""

    def _recent_rate(self) -> float:
        """Rate at which the device takes samples, lost ones counted [Hz]."""
        if len(self._recent) < 2 or self._recent[-1][0] - self._recent[0][0] < _SLOW_OVER:
            return self._rate
        (first, start), (last, end) = self._recent[0], self._recent[-1]
        return (last - first) * 1e9 / max(end - start, 1) / self._clock_rate

    def _forget_old(self) -> None:
        """Keep what the next rate needs, once one was told."""
        recent = self._recent
        while len(recent) > 2 and recent[-1][0] - recent[1][0] >= _SLOW_OVER:
            recent.popleft()

    def _changed(self, state: str, text: str, unix_ns: int) -> list[Message]:
        was, self.state, self._text = self.state, state, text
        if state == "running" and was == "starting":
            return []
        severity, code = _STATE_EVENTS.get(state, ("info", state))
        said = text or f"{state}, was {was}"
        return [Event(self._source, unix_ns, severity, code, said)]

    def _failed_polls(
        self, unix_ns: int, link: Link, counters: Mapping[str, float]
    ) -> Iterator[Message]:
        """An event for the first failed poll of a second, as soon as it has failed."""
        failed, before = counters.get("failed_polls", 0.0), self._polls_failed
        self._polls_failed = failed
        if failed > before and unix_ns - self._failure_told_ns >= _SECOND:
            self._failure_told_ns = unix_ns
            yield Event(self._source, unix_ns, "warning", "poll_failed", link.trouble)

    def _second(self, now_ns: int, unix_ns: int, counters: Mapping[str, float]) -> list[Message]:
        self._update_rates(now_ns)
        self._line_trouble = self._troubled(counters)
        self._second_ns, self._before = now_ns, dict(counters)
        return self._drift(unix_ns, counters)

    def _update_rates(self, now_ns: int) -> None:
        if self._second_ns is None or self._first_ns is None:
            self._second_samples = self._samples
            return
        now = (self._samples - self._second_samples) * 1e9 / (now_ns - self._second_ns)
        whole = self._first_ns <= self._second_ns
        later = self._samples - self._first_samples
        worst = self._rates["rate_worst_hz"] or np.inf
        self._rates = {
            "rate_hz": now,
            "rate_mean_hz": later * 1e9 / max(now_ns - self._first_ns, 1),
            "rate_worst_hz": min(worst, now) if whole else self._rates["rate_worst_hz"],
        }
        self._second_samples = self._samples

    def _troubled(self, counters: Mapping[str, float]) -> tuple[str, str] | None:
        """State and text of what was wrong with the line in the last second."""
        if garbage := self._garbage(counters):
            return "garbage", garbage
        foreign = counters.get("foreign_samples", 0.0) - self._before.get("foreign_samples", 0.0)
        text = f"{foreign:.0f} samples of a second device on the same line are not used"
        return ("two devices", text) if foreign > 0 else None

    def _garbage(self, counters: Mapping[str, float]) -> str:
        skipped, count, good = (
            counters.get(name, 0.0) - self._before.get(name, 0.0)
            for name in ("skipped_bytes", "bytes", "good_frames")
        )
        if count == 0 or skipped <= _GARBAGE * count:
            return ""
        share = f"{100 * skipped / count:.0f} % of {count:.0f} bytes are no frames"
        return share if good else f"{share}: wrong baud rate, or not a device of rigwatch?"

    def _drift(self, unix_ns: int, counters: Mapping[str, float]) -> list[Message]:
        certain = abs(counters.get("certain_drift_ppm", 0.0))
        severity: Severity = next((s for limit, s in _DRIFT_LIMITS if certain > limit), "info")
        if severity == self._drift_severity:
            return []
        self._drift_severity, drift = severity, counters.get("drift_ppm", 0.0)
        text = f"the device's clock is off by {drift:+.0f} ppm"
        return [Event(self._source, unix_ns, severity, "clock_drift", text)]

    def _implausible(self, unix_ns: int) -> list[Message]:
        """Once, in the first second of samples: channels that are mostly out of range."""
        least = max(_PLAUSIBLE_LEAST, _PLAUSIBLE_AFTER_S * self._rate)
        if self._outside.get("", 0) or self._samples < least:
            return []
        wrong = [name for name, count in self._outside.items() if count > self._samples // 2]
        self._outside[""] = 1
        hint = "mostly outside of its range: wrong unit, gain or order of channels?"
        return [
            Event(self._source, unix_ns, "error", "implausible", f"channel {name} is {hint}")
            for name in wrong
        ]

    def count_flags(self, channel: str, flags: np.ndarray) -> None:
        """Count the flags of a channel's samples."""
        if not np.count_nonzero(flags):  # a quarter of what `any` takes
            return
        for bit, name in quality.NAMES.items():
            count = int(np.count_nonzero(flags & bit))
            self._flagged[name.replace("-", "_")] += count
            if bit == quality.SATURATED:
                self._outside[channel] = self._outside.get(channel, 0) + count

    def _health(
        self,
        now_ns: int,
        unix_ns: int,
        text: str,
        link: Link,
        counters: Mapping[str, float],
    ) -> Health:
        age = 0 if self._last_ns is None else now_ns - self._last_ns
        figures = {
            **self._rates,
            "samples": float(self._samples),
            **{name: float(value) for name, value in counters.items()},
            "reconnects": float(link.reconnects),
            "silence_ms": age / 1e6,
            **{f"flagged_{name}": float(count) for name, count in sorted(self._flagged.items())},
        }
        return Health(self._source, unix_ns, self.state, text, figures)

"""What the monitor notices without a sample: silence, a missing daq, a second source, losses.

Each is an alarm that clears by itself when its reason is gone. `LinkWatch` is told the time and
what was seen, and reads neither clock nor bus.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from monitor.alarms import Occasion
from rigwatch.wire.messages import Health

LOSS_SHOWN_NS = 1_000_000_000
"""A loss stands for this long after its last gap [ns]."""
CLOCK_STEP_NS = 500_000_000
"""A wall clock that moves by more against the monotonic one was set [ns]."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What the process sees at one moment.

    Attributes:
        t_ns: Unix time [ns].
        monotonic_ns: time on a clock that nobody sets [ns].
        silent_s: time since the last sample came [s].
        daq_trouble: why no samples can come, as far as daq says so or is gone; "" for no reason.
        contested: whether a second source sends samples.
        device: the device's name.
        position: (boot, seq) of the last sample.
    """

    t_ns: int
    monotonic_ns: int
    silent_s: float
    daq_trouble: str
    contested: bool
    device: str
    position: tuple[int, int]


class LinkWatch:
    """Decides which of the link's alarms hold.

    Args:
        stale_after: silence that means stale [s].
    """

    def __init__(self, stale_after: float) -> None:
        self._stale_after = stale_after
        self._lost = 0
        self._lost_at_ns = -LOSS_SHOWN_NS
        self._clock_offset_ns: int | None = None

    def lost(self, samples: int, monotonic_ns: int) -> None:
        """Samples were lost; 0 for an unknown number."""
        self._lost += samples
        self._lost_at_ns = monotonic_ns

    def reports(self, seen: Seen) -> Iterator[tuple[str, Occasion, bool]]:
        """Name, occasion and whether it holds, of every alarm of the link."""
        silent_ms, limit_ms = seen.silent_s * 1e3, self._stale_after * 1e3
        stale = seen.silent_s > self._stale_after
        yield "stale", _occasion(seen, silent_ms, limit_ms), stale
        yield "link", _occasion(seen, text=seen.daq_trouble), stale and bool(seen.daq_trouble)
        yield "duplicate_source", _occasion(seen), seen.contested
        losing = seen.monotonic_ns - self._lost_at_ns < LOSS_SHOWN_NS
        yield "loss", _occasion(seen, float(self._lost), 0.0, "samples lost so far"), losing

    def clock_step(self, seen: Seen) -> int:
        """By how much the wall clock was set since the last call [ns]; 0 where it was not."""
        offset, before = seen.t_ns - seen.monotonic_ns, self._clock_offset_ns
        self._clock_offset_ns = offset
        step = 0 if before is None else offset - before
        return step if abs(step) > CLOCK_STEP_NS else 0


def disk_report(seen: Seen, troubled: Health | None) -> tuple[str, Occasion, bool]:
    """The same of the alarm `disk`: the recorder's last word, where that was trouble."""
    if troubled is None:
        return "disk", _occasion(seen), False
    free = troubled.counters.get("free_share", float("nan"))
    text = troubled.text or f"{free:.1%} of the disk is free"
    return "disk", _occasion(seen, text=text), True


def _occasion(
    seen: Seen, value: float = float("nan"), high: float = float("nan"), text: str = ""
) -> Occasion:
    boot, seq = seen.position
    return Occasion(
        seen.device, boot, seq, seen.t_ns, value, float("nan"), high, onset_seq=seq, text=text
    )

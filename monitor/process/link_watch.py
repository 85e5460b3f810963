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
DRIFT_PPM = 500.0
"""A device's clock that runs faster or slower by more is worth an alarm [ppm]."""
UNJUDGED_S = 1.0
"""Samples without an estimate for longer are an alarm [s]."""
ALMOST_FULL = 0.02
"""Share of the disk below which recording ends soon."""
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


def device_reports(
    seen: Seen, daq: Health | None, unjudged_s: float, why: str
) -> Iterator[tuple[str, Occasion, bool]]:
    """The same for what is wrong with the device although samples arrive.

    Args:
        seen: what the process sees now.
        daq: the last health message of data acquisition, None if there is none.
        unjudged_s: time since the last estimate, while samples arrived [s].
        why: why there are none, "" if that is not known.
    """
    state, text = (daq.state, daq.text) if daq else ("", "")
    yield "line_noise", _occasion(seen, text=text), state == "garbage"
    yield "slow_device", _occasion(seen, text=text), state == "slow"
    drift = abs(daq.counters.get("drift_ppm", 0.0)) if daq else 0.0
    at = _occasion(seen, drift, DRIFT_PPM, f"off by {drift:.0f} ppm")
    yield "clock_drift", at, drift > DRIFT_PPM
    yield "estimates_missing", _occasion(seen, text=why), unjudged_s > UNJUDGED_S


def disk_reports(
    seen: Seen, recorder: Health | None, alive: bool, journal_failure: str = ""
) -> Iterator[tuple[str, Occasion, bool]]:
    """The same for the alarms of disk and recording.

    Args:
        seen: what the process sees now.
        recorder: the recorder's last health message, None if it has never sent one.
        alive: whether the recorder's process is there.
        journal_failure: why the alarm journal cannot be written, "" if it can.
    """
    free = recorder.counters.get("free_share", -1.0) if recorder else -1.0
    short = bool(recorder and recorder.counters.get("disk_trouble", 0.0) > 0.0)
    text = (recorder.text if recorder and short else "") or journal_failure
    free_text = f"{free:.1%} of the disk is free"
    yield "disk", _occasion(seen, text=text or free_text), short or bool(journal_failure)
    yield "disk_almost_full", _occasion(seen, text=free_text), 0.0 <= free < ALMOST_FULL
    gone = recorder is not None and not alive
    stopped = recorder is not None and recorder.state == "not recording"
    why = "the recorder process is not there" if gone else recorder.text if recorder else ""
    yield "recording_stopped", _occasion(seen, text=why), gone or stopped


def _occasion(
    seen: Seen, value: float = float("nan"), high: float = float("nan"), text: str = ""
) -> Occasion:
    boot, seq = seen.position
    return Occasion(
        seen.device, boot, seq, seen.t_ns, value, float("nan"), high, onset_seq=seq, text=text
    )

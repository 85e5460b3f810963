"""Alarms of the link: silence, a missing daq, a second source, losses.

Each alarm clears when its cause is gone. `LinkWatch` receives the time and the observations as
arguments and reads neither clock nor bus.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from monitor.alarms import Occasion
from rigwatch.wire.messages import Health

LOSS_SHOWN_NS = 1_000_000_000
"""Time for which a loss alarm holds after the last gap [ns]."""
DRIFT_PPM, WRONG_PPM = 500.0, 5000.0
"""Clock deviations of a device above which a warning and an error are raised [ppm]."""
REASON_LASTS_NS, TOLD_LASTS_NS = 2_000_000_000, 60_000_000_000
"""Time after which another reason of an absent device is told, and one that has been told before;
attempts to open it fail in turn for several reasons [ns].
"""
UNJUDGED_S = 1.0
"""Time without an estimate, while samples arrive, after which an alarm is raised [s]."""
ALMOST_FULL = 0.02
"""Share of free disk below which recording is about to stop."""
CLOCK_STEP_NS = 500_000_000
"""Step of the wall clock against the monotonic one that counts as setting the clock [ns]."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Observations of the process at one moment.

    Attributes:
        t_ns: Unix time [ns].
        monotonic_ns: monotonic time [ns].
        silent_s: time since the last sample [s].
        daq_trouble: why no samples arrive, as reported by daq or because it is gone; otherwise "".
        flowed: whether samples have flowed; before that daq may just be starting.
        contested: whether a second source sends samples.
        device: the device's name.
        position: (boot, seq) of the last sample.
    """

    t_ns: int
    monotonic_ns: int
    silent_s: float
    daq_trouble: str
    flowed: bool
    contested: bool
    device: str
    position: tuple[int, int]


class Cause(NamedTuple):
    """Why an alarm holds that no sample raises: a value and its limit, and what the cause adds."""

    value: float = float("nan")
    high: float = float("nan")
    text: str = ""


Report = tuple[str, Cause, bool]
"""Name of an alarm, its cause if it holds, and whether it does."""


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
        self._reason, self._reason_since_ns = "", 0
        self._told: set[str] = set()

    def lost(self, samples: int, monotonic_ns: int) -> None:
        """Record lost samples; 0 for an unknown number."""
        self._lost += samples
        self._lost_at_ns = monotonic_ns

    def reports(self, seen: Seen) -> Iterator[Report]:
        """Every alarm of the link."""
        silent_ms, limit_ms = seen.silent_s * 1e3, self._stale_after * 1e3
        stale = seen.silent_s > self._stale_after
        yield "stale", Cause(silent_ms, limit_ms), stale
        gone = bool(seen.daq_trouble) and (stale or seen.flowed)
        yield "link", Cause(text=seen.daq_trouble), gone
        yield "duplicate_source", Cause(), seen.contested
        losing = seen.monotonic_ns - self._lost_at_ns < LOSS_SHOWN_NS
        yield "loss", Cause(float(self._lost), 0.0, "samples lost so far"), losing

    def lasting_reason(self, seen: Seen) -> str:
        """Why no samples arrive, once it has been the same reason for a while; "" before."""
        if not seen.daq_trouble:
            self._told.clear()
        if seen.daq_trouble != self._reason:
            self._reason, self._reason_since_ns = seen.daq_trouble, seen.monotonic_ns
        lasts = TOLD_LASTS_NS if self._reason in self._told else REASON_LASTS_NS
        if seen.monotonic_ns - self._reason_since_ns < lasts:
            return ""
        self._told.add(self._reason)
        return self._reason

    def clock_step(self, seen: Seen) -> int:
        """Step of the wall clock since the last call [ns]; 0 if it was not set."""
        offset, before = seen.t_ns - seen.monotonic_ns, self._clock_offset_ns
        self._clock_offset_ns = offset
        step = 0 if before is None else offset - before
        return step if abs(step) > CLOCK_STEP_NS else 0


def device_reports(daq: Health | None, unjudged_s: float, why: str) -> Iterator[Report]:
    """The same for faults of the device while samples arrive.

    Args:
        daq: the last health message of data acquisition, None if there is none.
        unjudged_s: time since the last estimate, while samples arrived [s].
        why: why there are no estimates, "" if unknown.
    """
    state, text = (daq.state, daq.text) if daq else ("", "")
    yield "line_noise", Cause(text=text), state == "garbage"
    yield "slow_device", Cause(text=text), state == "slow"
    drift, certain = _drift(daq.counters if daq else {})
    at = Cause(drift, DRIFT_PPM, f"off by {drift:.0f} ppm")
    yield "clock_drift", at, certain > DRIFT_PPM
    at = Cause(drift, WRONG_PPM, f"off by {drift:.0f} ppm")
    yield "clock_wrong", at, certain > WRONG_PPM
    yield "estimates_missing", Cause(text=why), unjudged_s > UNJUDGED_S


def _drift(counters: Mapping[str, float]) -> tuple[float, float]:
    """Size of the drift and what of it is certain [ppm]; a daq of an earlier version tells one."""
    drift = counters.get("drift_ppm", 0.0)
    return abs(drift), abs(counters.get("certain_drift_ppm", drift))


def disk_reports(
    recorder: Health | None, absence: str, journal_failure: str = ""
) -> Iterator[Report]:
    """The same for the alarms of disk and recording.

    Args:
        recorder: the recorder's last health message, None if it has never sent one.
        absence: why the recorder's process is not seen, "" if it is.
        journal_failure: why the alarm journal cannot be written, "" if it can.
    """
    free = recorder.counters.get("free_share", -1.0) if recorder else -1.0
    short = bool(recorder and recorder.counters.get("disk_trouble", 0.0) > 0.0)
    text = (recorder.text if recorder and short else "") or journal_failure
    free_text = f"{free:.1%} of the disk is free"
    yield "disk", Cause(text=text or free_text), short or bool(journal_failure)
    yield "disk_almost_full", Cause(text=free_text), 0.0 <= free < ALMOST_FULL
    gone = recorder is not None and bool(absence)
    stopped = recorder is not None and recorder.state == "not recording"
    why = absence if gone else recorder.text if recorder else ""
    yield "recording_stopped", Cause(text=why), gone or stopped


OF_OTHERS = frozenset(
    name for name, *_ in (*device_reports(None, 0.0, ""), *disk_reports(None, ""))
)
"""The alarms of what daq and recorder say: samples go on meanwhile."""


def occasion(seen: Seen, cause: Cause, t_ns: int) -> Occasion:
    """The occasion at `t_ns` [ns] of an alarm that no sample raises."""
    boot, seq = seen.position
    nan = float("nan")
    return Occasion(
        seen.device, boot, seq, t_ns, cause.value, nan, cause.high, onset_seq=seq, text=cause.text
    )

"""The time by which recordings are old: the wall clock's, as far as it can be believed.

What is removed is gone, so a clock that is wrong by years must not make all recordings old, neither
while a recorder runs nor when it starts:

    while it runs                      ages grow twice as fast as time passes, at most
    it starts again, on the same boot  the same: the steady clock has counted what lies between
    the machine was off                nobody knows for how long: as the clock says, but no longer
                                       than half of what is kept

So no one wrong start, nor a clock that is wrong while time passes, ends a recording that is younger
than half of its time. A clock that is set back is followed at once, and again ahead to where it
was.
"""

import contextlib
from pathlib import Path

import msgspec

from rigwatch.wire.host import replace_file
from rigwatch.wire.rig_config import RecorderSection
from rigwatch.wire.typed_files import JsonError, json_value

FASTEST = 2.0
"""How fast ages grow at most, in seconds a second: a clock that was set is followed so."""
EARLIEST_NS, LATEST_NS = 1_735_689_600 * 10**9, 1 << 62
"""A clock that says less is wrong [ns], as that of a machine which begins in 1970: in 2025 nothing
had been recorded yet. Later than the other no clock is."""
NOTED_EVERY = 60.0
"""Time between two notes of the present time [s]."""
_DAY_NS = 86_400 * 10**9
_BOOT = Path("/proc/sys/kernel/random/boot_id")


class Moment(msgspec.Struct, frozen=True):
    """The state of an `AgeClock`.

    Attributes:
        age_ns: time by which ages counted [ns].
        reached_ns: the latest such time so far [ns].
        behind_ns: for how long the clock has been behind that [ns].
        wall_ns, steady_ns: Unix and monotonic time [ns].
        boot: names the run of the machine that counts the monotonic time; "" if it has no name.
    """

    age_ns: int
    reached_ns: int
    behind_ns: int
    wall_ns: int
    steady_ns: int
    boot: str


class AgeClock:
    """Unix time by which ages count; reads no clock.

    Args:
        settings: section [recorder], which says how long recordings are kept.
        note: file in which this time is noted for the next start; None for no note. Where nothing
            is limited by its age, nothing is noted.
        newest_ns: when the newest recording was written, which counts without a note; None if there
            is no recording [ns].
        boot: name of the machine's present run.

    Attributes:
        lag_s: by how much this time was behind the wall clock at the last call [s].
    """

    def __init__(
        self,
        settings: RecorderSection,
        note: Path | None = None,
        newest_ns: int | None = None,
        boot: str = "",
    ) -> None:
        self._longest_stop_ns = _least_kept_ns(settings) // 2
        self._note = note
        self._boot = boot
        self._last = _noted(self._note) or _written(newest_ns)
        self._noted_s: float | None = None
        self.lag_s = 0.0

    def now_ns(self, monotonic_s: float, wall_ns: int) -> int:
        """This time at a moment [ns], given as monotonic time [s] and Unix time [ns]."""
        if wall_ns < EARLIEST_NS or not self._longest_stop_ns:
            return wall_ns
        steady_ns, last = round(monotonic_s * 1e9), self._last
        if last is None:
            last = Moment(wall_ns, wall_ns, 0, wall_ns, steady_ns, self._boot)
        age_ns = min(wall_ns, self._latest_ns(last, steady_ns, wall_ns))
        reached_ns, behind_ns = age_ns, 0
        if last.reached_ns > age_ns:
            behind_ns = last.behind_ns + (self._passed_ns(last, steady_ns) or 0)
            # A clock that was set back and stays there is right: ahead is wrong again.
            reached_ns = age_ns if behind_ns > self._longest_stop_ns else last.reached_ns
        self._last = Moment(age_ns, reached_ns, behind_ns, wall_ns, steady_ns, self._boot)
        self.lag_s = (wall_ns - age_ns) / 1e9
        if self._noted_s is None or monotonic_s - self._noted_s >= NOTED_EVERY:
            self._noted_s = monotonic_s
            self.note()
        return age_ns

    def note(self) -> None:
        """Note the present time; without it, as on a full disk, the earlier one counts."""
        if self._note is not None and self._noted_s is not None:
            with contextlib.suppress(OSError):
                replace_file(self._note, msgspec.json.encode(self._last), durable=False)

    def _latest_ns(self, last: Moment, steady_ns: int, wall_ns: int) -> int:
        """The latest time that is believed at a moment [ns]."""
        passed_ns = self._passed_ns(last, steady_ns)
        if passed_ns is None:
            grown_ns = min(max(0, wall_ns - last.wall_ns), self._longest_stop_ns)
        else:
            grown_ns = round(FASTEST * passed_ns)
        return max(last.reached_ns, last.age_ns + grown_ns)

    def _passed_ns(self, last: Moment, steady_ns: int) -> int | None:
        """Time that has passed [ns]; None if the machine was off in between."""
        same = last.boot == self._boot and (self._boot or self._noted_s is not None)
        return steady_ns - last.steady_ns if same and steady_ns >= last.steady_ns else None


def clock_of(settings: RecorderSection, rig: str, newest_ns: int | None) -> AgeClock:
    """The clock of the recordings of one rig, from where its last recorder left it.

    Args:
        settings: section [recorder].
        rig: whose recordings.
        newest_ns: when the newest of them was written, None if there is none [ns].
    """
    boot = ""
    with contextlib.suppress(OSError, ValueError):
        boot = _BOOT.read_text(encoding="ascii").strip()
    return AgeClock(settings, Path(settings.folder) / f".{rig}.age", newest_ns, boot)


def _least_kept_ns(settings: RecorderSection) -> int:
    """The shortest time for which anything is kept [ns]; 0 without a limit."""
    days = (
        settings.keep_days, settings.keep_alarm_days,
        settings.thin_days, settings.thin_alarm_days,
    )  # fmt: skip
    return round(min((one for one in days if one > 0), default=0.0) * _DAY_NS)


def _noted(note: Path | None) -> Moment | None:
    """The noted moment; None if there is none, or none that can be."""
    try:
        found = json_value(note.read_bytes(), Moment) if note is not None else None
    except (OSError, JsonError):
        return None
    times = () if found is None else (found.age_ns, found.reached_ns, found.wall_ns)
    return found if all(EARLIEST_NS <= one < LATEST_NS for one in times) else None


def _written(newest_ns: int | None) -> Moment | None:
    """The moment at which a recording was written."""
    if newest_ns is None or newest_ns < EARLIEST_NS:
        return None
    return Moment(newest_ns, newest_ns, 0, newest_ns, 0, "")

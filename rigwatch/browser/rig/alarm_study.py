"""A study made from an alarm: healthy data before its onset, and data after it."""

from pathlib import Path

from rigwatch.browser.recordings import make_study
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import Alarm
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.session import SUFFIX, Session, newest, open_session, trim
from rigwatch.workbench.study import Study

HEALTHY = 5.0
"""Length of the healthy part [s]."""
FAULTY = 10.0
"""Longest part with the fault [s]."""
LEAST = 4.0
"""Shortest useful part [s]."""
AROUND = 0.5
"""Time skipped on both sides of the onset, and between training and held-out data [s]."""
TEMPLATE = "rig"


def study_of_alarm(root: Path, config: RigConfig, alarm: Alarm) -> Study:
    """Cut the recording around an alarm's onset and create a study from it.

    Args:
        root: folder of the studies.
        config: the rig's configuration.
        alarm: the alarm.

    Raises:
        SessionError: too little was recorded before or after the onset.
        ConfigError: there is such a study already.
    """
    if config.recorder is None:
        raise SessionError("found no [recorder] of the rig, expected one that has what it did")
    held = (alarm.seq - alarm.onset_seq) / config.rig.sample_rate if alarm.onset_seq >= 0 else 0.0
    onset = alarm.t_ns - round(held * 1e9)
    session = _session_of(Path(config.recorder.folder), onset)
    times = [block.t_ns for block in session.samples()]
    if not times:
        raise SessionError(f"{session.path}: found no samples, expected those around the alarm")
    first, last = int(times[0][0]), int(times[-1][-1])
    before, after = (onset - first) / 1e9 - AROUND, (last - onset) / 1e9 - AROUND
    for seconds, where in ((before, "before"), (after, "after")):
        if seconds < LEAST:
            raise SessionError(
                f"{alarm.name}: found {max(seconds, 0):.1f} s recorded {where} its onset, expected"
                f" at least {LEAST:g} s"
            )
    name = f"{alarm.name}-{alarm.t_ns // 1_000_000_000}"
    folder = root / "recordings"
    folder.mkdir(exist_ok=True)
    healthy, faulty = (folder / f"{name}-{part}.mcap" for part in ("healthy", "fault"))
    around = round(AROUND * 1e9)
    if not healthy.exists():
        trim(session, healthy, onset - around - round(min(before, HEALTHY) * 1e9), onset - around)
    length = min(after, FAULTY)
    if not faulty.exists():
        trim(session, faulty, onset + around, onset + around + round(length * 1e9))
    half = (length - AROUND) / 2
    parts = [
        ("train", faulty, 0.0, half),
        ("held_out", faulty, half + AROUND, None),
        ("healthy", healthy, 0.0, None),
    ]
    return make_study(root / name, TEMPLATE, parts)


def _session_of(folder: Path, onset: int) -> Session:
    """The newest session with a healthy part before an onset [ns]; else the newest of all.

    A recorder that was restarted has begun another one.
    """
    files = sorted(folder.glob(f"*/*{SUFFIX}"), key=lambda file: -file.stat().st_mtime)
    for path in dict.fromkeys(file.parent for file in files):
        session = open_session(path)
        first = next(session.samples(size=1), None)
        if first is not None and first.t_ns[0] <= onset - round((LEAST + AROUND) * 1e9):
            return session
    return open_session(newest(folder))

"""A study made from an alarm: healthy data before its onset, and data after it."""

import time
from collections.abc import Sequence
from pathlib import Path

from monitor.alarms import settings_of
from monitor.model import EquationsPlant, load_model
from rigwatch.browser.recordings import Part, make_study
from rigwatch.browser.rig.onset import Ending, Onset, onset_of
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import Alarm
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.session import trim
from rigwatch.workbench.study import FILE, Study, open_study

HEALTHY = 5.0
"""Length of the healthy part [s]."""
FAULTY = 10.0
"""Longest part with the fault [s]."""
LEAST = 4.0
"""Shortest useful part [s]."""
AROUND = 0.5
"""Time skipped on both sides of the onset, and between training and held-out data [s]."""
FRESH = 3.0
"""Age of the last sample up to which the recording counts as running [s]."""
QUIET, QUIET_ALONG = 128, 288
"""Samples after the end of a fault after which the monitor's verdict ends: those of its windows,
and those that have to be quiet; in the friction scheme and where equations are watched.
"""
TEMPLATE = "rig"
"""Used where the monitor's model has no equations."""


class TooSoonError(SessionError):
    """The fault is still being recorded; `seconds` more make the longest part."""

    def __init__(self, name: str, seconds: float) -> None:
        super().__init__(f"{name}: its recording lasts {seconds:.0f} s more")
        self.seconds = seconds


def study_of_alarm(root: Path, config: RigConfig, alarm: Alarm, now: float | None = None) -> Study:
    """Cut the recording around an alarm's onset and create a study from it, once per onset.

    Args:
        root: folder of the studies.
        config: the rig's configuration.
        alarm: the alarm.
        now: Unix time, that of this machine if None [s].

    Raises:
        TooSoonError: the fault lasts, and is still being recorded.
        SessionError: too little was recorded before or after the onset.
    """
    if config.recorder is None:
        raise SessionError("found no [recorder] of the rig, expected one that has what it did")
    if alarm.seq < 0:
        raise SessionError(f"{alarm.name}: found no sample that raised it, expected one")
    onset = onset_of(Path(config.recorder.folder), config.rig.id, alarm)
    name = f"{alarm.name}-{onset.t_ns // 1_000_000_000}"
    if (root / name / FILE).exists():
        return open_study(root / name)
    plant = _plant(config)
    ending = _ending(config, alarm, QUIET if plant is None else QUIET_ALONG)
    before, after = _lengths(alarm, onset, ending, time.time() if now is None else now)
    folder = root / "recordings"
    folder.mkdir(exist_ok=True)
    healthy = _cut(onset, folder / f"{name}-healthy.mcap", -AROUND - before, -AROUND)
    faulty = _cut(onset, folder / f"{name}-fault.mcap", AROUND, AROUND + after)
    half = (after - AROUND) / 2
    parts = [
        ("train", faulty, 0.0, half),
        ("held_out", faulty, half + AROUND, None),
        ("healthy", healthy, 0.0, None),
    ]
    return _made(root / name, plant, parts)


def _plant(config: RigConfig) -> EquationsPlant | None:
    """The equations that the monitor runs; None if its scheme is another one."""
    file = Path(config.monitor.model) if config.monitor else None
    plant = load_model(file).plant if file and file.is_file() else None
    return plant if isinstance(plant, EquationsPlant) else None


def _ending(config: RigConfig, alarm: Alarm, quiet: int) -> Ending:
    """How long after a fault its end is known; `quiet` is in samples."""
    settings = settings_of(alarm.name, config.monitor.alarms if config.monitor else {})
    rate = config.rig.sample_rate
    return Ending(quiet / rate, (quiet + settings.clear_after) / rate)


def _made(folder: Path, plant: EquationsPlant | None, parts: Sequence[Part]) -> Study:
    """With the equations that the monitor runs, from their healthy values; else the template's."""
    if plant is None:
        return make_study(folder, TEMPLATE, parts)
    start = dict(zip(plant.names, plant.values, strict=True))
    own = Path(plant.model) if plant.model.endswith(".toml") else None
    begin = f"model:{plant.model}"
    return make_study(folder, begin, parts, own, start, variants=plant.variants)


def _lengths(alarm: Alarm, onset: Onset, ending: Ending, now: float) -> tuple[float, float]:
    """Lengths of the healthy part and of the part with the fault [s]."""
    before, after = onset.recorded(AROUND + HEALTHY, AROUND + FAULTY)
    age, lasted = now - onset.t_ns / 1e9 - after, onset.lasted(alarm.name, ending)
    calm = onset.calm(ending)
    after = (after if lasted is None else min(after, lasted)) - AROUND
    since = "before its onset" if before <= calm else "between an earlier fault and its onset"
    before = min(before, calm) - AROUND
    if lasted is None and age < FRESH and (missing := FAULTY - after) > AROUND / 10:
        raise TooSoonError(alarm.name, missing)
    for seconds, what in ((before, since), (after, "of the fault")):
        if seconds < LEAST:
            raise SessionError(
                f"{alarm.name}: found {max(seconds, 0):.1f} s recorded {what}, expected at least"
                f" {LEAST:g} s"
            )
    return before, after


def _cut(onset: Onset, target: Path, start: float, end: float) -> Path:
    """The file with a span of the recording, in seconds after the onset."""
    if not target.exists():
        trim(onset.session, target, *(onset.t_ns + round(at * 1e9) for at in (start, end)))
    return target

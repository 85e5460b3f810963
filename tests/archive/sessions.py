"""Sessions of rigs with known estimates, alarms and losses."""

from pathlib import Path

import numpy as np

from rigwatch.wire.messages import Alarm, Column, EstimateBlock, Gap, SampleBlock
from rigwatch.wire.session import SessionWriter, run_info

RATE = 16
DAY_S = 86_400
EPOCH_S = 1_767_225_600
"""2026-01-01 [s]."""


def write_session(
    path: Path,
    *,
    rig: str = "bench1",
    start_s: float = 0.0,
    seconds: int = 4,
    friction: float = 1.0,
    missing: int = 0,
    alarm: str = "",
    boot: int = 1,
    close: bool = True,
) -> Path:
    """A session from `start_s` seconds after the epoch on, with friction that drifts a little."""
    path.parent.mkdir(parents=True, exist_ok=True)
    count = seconds * RATE
    t_ns = np.int64((EPOCH_S + start_s) * 1e9) + np.arange(count) * (10**9 // RATE)
    writer = SessionWriter(path, run_info(rig, RATE, t_ns=int(t_ns[0])), sync=False)
    half = count // 2
    for at in (0, half):
        part = slice(at, at + half)
        seq = at + (missing if at else 0)
        values = theta1(friction, count)[part]
        good = np.zeros(half, np.uint8)
        position = Column("position", "m", np.ones(half), good)
        writer.write(SampleBlock("rig", boot, seq, t_ns[part] // 1000, t_ns[part], (position,)))
        theta = Column("theta1", "N", values)
        writer.write(EstimateBlock("rig", boot, seq, t_ns[part], (theta,)))
        writer.flush()
    if missing:
        writer.write(Gap("rig", boot, half, half + missing - 1, int(t_ns[half]), "daq", "line"))
    if alarm:
        writer.write(_alarm(alarm, boot, int(t_ns[-2]), 1.5))
        writer.write(_alarm(alarm, boot, int(t_ns[-1]), 2.0))
    writer.flush()
    if close:
        writer.close()
    else:
        writer.abandon()
    return path


def theta1(friction: float, count: int) -> np.ndarray:
    """The estimates of a session; one of them is no number."""
    values = friction + 0.01 * np.arange(count)
    values[3] = np.nan
    return values


def _alarm(name: str, boot: int, t_ns: int, value: float) -> Alarm:
    """An alarm, or its value told again."""
    text = ("rubs", "stop")
    limits = (value, 0.0, 1.0)
    return Alarm(name, "unacknowledged", "error", *text, "rig", boot, 0, t_ns, *limits, True, "", 0)

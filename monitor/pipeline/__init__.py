"""The processing pipeline from samples to results, without clock, bus or files.

RigMonitor.update(block) ──▶ admission ──▶ residual ──▶ decision ──▶ estimates ──▶ alarms
"""

from monitor.pipeline.pipeline import Monitor
from monitor.pipeline.promoted import check_can_follow
from monitor.pipeline.rig_monitor import Judged, RigMonitor, Watched, compile_kernels
from monitor.pipeline.together import (
    Finish,
    Ready,
    compile_together,
    judge_alone,
    judge_together,
    ready_of,
)

__all__ = [
    "Finish",
    "Judged",
    "Monitor",
    "Ready",
    "RigMonitor",
    "Watched",
    "check_can_follow",
    "compile_kernels",
    "compile_together",
    "judge_alone",
    "judge_together",
    "ready_of",
]

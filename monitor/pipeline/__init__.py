"""The processing pipeline from samples to results, without clock, bus or files.

RigMonitor.update(block) ──▶ admission ──▶ residual ──▶ decision ──▶ estimates ──▶ alarms
"""

from monitor.pipeline.pipeline import PUBLISHED_NAMES, Monitor
from monitor.pipeline.promoted import check_can_follow
from monitor.pipeline.rig_monitor import Judged, RigMonitor, Watched, compile_kernels
from monitor.pipeline.steady_kernel import Outputs, RowOutputs
from monitor.pipeline.steady_rows import (
    CHANGE_ROW,
    OUTPUT_ROWS,
    ColumnBytes,
    SampleRows,
    SteadyRows,
    completed,
)
from monitor.pipeline.together import (
    Finish,
    Ready,
    compile_together,
    judge_alone,
    judge_together,
    places_of,
    ready_of,
)

__all__ = [
    "CHANGE_ROW",
    "OUTPUT_ROWS",
    "PUBLISHED_NAMES",
    "ColumnBytes",
    "Finish",
    "Judged",
    "Monitor",
    "Outputs",
    "Ready",
    "RigMonitor",
    "RowOutputs",
    "SampleRows",
    "SteadyRows",
    "Watched",
    "check_can_follow",
    "compile_kernels",
    "compile_together",
    "completed",
    "judge_alone",
    "judge_together",
    "places_of",
    "ready_of",
]

"""The processing pipeline from samples to results, without clock, bus or files.

RigMonitor.update(block) ──▶ admission ──▶ residual ──▶ decision ──▶ estimates ──▶ alarms
"""

from monitor.pipeline.pipeline import Monitor
from monitor.pipeline.promoted import check_can_follow
from monitor.pipeline.rig_monitor import RigMonitor, Watched, compile_kernels

__all__ = ["Monitor", "RigMonitor", "Watched", "check_can_follow", "compile_kernels"]

"""Clipping: readings that repeat at an extreme, as of a sensor or converter at its limit."""

from monitor.clipping.clipping import Clipping, SteadyClipping
from monitor.clipping.flat_top import NEVER, judge_flat_tops, new_flat_tops

__all__ = ["NEVER", "Clipping", "SteadyClipping", "judge_flat_tops", "new_flat_tops"]

"""The workbench from Python and in notebooks: the commands as methods of a study.

study_object ──▶ shown (results that display themselves) ──▶ data_frames (arrays in and out)
            └──▶ plots (matplotlib)
"""

from rigwatch.workbench.api.data_frames import NamedArrays
from rigwatch.workbench.api.shown import Shown
from rigwatch.workbench.api.study_object import Study

__all__ = ["NamedArrays", "Shown", "Study"]

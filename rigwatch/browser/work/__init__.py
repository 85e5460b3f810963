"""Long tasks on studies: one process per study, results on disk, cancelling at any time."""

from rigwatch.browser.work.apart import ApartError, Turns, apart
from rigwatch.browser.work.desk import Desk, Desks, Job, Told
from rigwatch.browser.work.directions import Directions
from rigwatch.browser.work.rehearsal import model_in_force
from rigwatch.browser.work.results import FOLDER as RESULTS
from rigwatch.browser.work.results import Results, results_of, signal_key
from rigwatch.browser.work.study_process import warm_up

__all__ = [
    "RESULTS",
    "ApartError",
    "Desk",
    "Desks",
    "Directions",
    "Job",
    "Results",
    "Told",
    "Turns",
    "apart",
    "model_in_force",
    "results_of",
    "signal_key",
    "warm_up",
]

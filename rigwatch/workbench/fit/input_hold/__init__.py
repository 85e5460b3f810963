"""The hold of inputs between samples, chosen from the data if neither model nor study gives it.

seen_held.py      whether the samples themselves show that inputs are held
hold_trials.py    models fitted with each hold, and whether one explains more than another
best_hold.py      the hold that explains most, and its delay
chosen_hold.py    the study with the hold that was chosen, with and without an effect in the model

A D/A converter holds its value until the next update (zero-order hold); a measured signal varies
linearly between samples. Confusing the two shifts the input by half a sample, which looks like a
slow sensor.
"""

from rigwatch.workbench.fit.input_hold.chosen_hold import (
    held_as,
    may_hide_slow,
    with_hold,
    with_hold_beside,
)
from rigwatch.workbench.fit.input_hold.hold_trials import explains_more, with_holds
from rigwatch.workbench.fit.input_hold.seen_held import stepped

__all__ = [
    "explains_more",
    "held_as",
    "may_hide_slow",
    "stepped",
    "with_hold",
    "with_hold_beside",
    "with_holds",
]

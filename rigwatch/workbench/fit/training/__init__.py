"""The training recordings: their error with states continued, and a part for what is only tried.

continued_error.py    the error with states of effects continued from window to window
training_part.py      a part of the recordings, and fits to the whole as seen on it
"""

from rigwatch.workbench.fit.training.continued_error import continued_train_error
from rigwatch.workbench.fit.training.training_part import (
    TrainingPart,
    each_recording,
    part_of,
)

__all__ = ["TrainingPart", "continued_train_error", "each_recording", "part_of"]

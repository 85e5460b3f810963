"""Result of a monitoring scheme for one block of samples."""

from dataclasses import dataclass

from monitor.signals import Condition
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import EstimateBlock


@dataclass(frozen=True)
class Result:
    """Result for one sample block.

    Args:
        estimates: the published columns, one row per new sample of the block.
        conditions: one of each of `conditions.CONDITION_KINDS`, and one of clipping for each
            channel that the model can judge, of the same length.
        drive: what the inputs do to the predicted acceleration at each sample, as judged [m/s^2],
            shape (n,); None where no equations predict it.
    """

    estimates: EstimateBlock
    conditions: tuple[Condition, ...]
    drive: FloatArray | None = None

"""Result of a monitoring scheme for one block of samples."""

from dataclasses import dataclass

from monitor.signals import Condition
from rigwatch.wire.messages import EstimateBlock


@dataclass(frozen=True)
class Result:
    """Result for one sample block.

    Args:
        estimates: the published columns, one row per new sample of the block.
        conditions: one of each of `conditions.CONDITION_KINDS`, and one of clipping for each
            channel that the model can judge, of the same length.
    """

    estimates: EstimateBlock
    conditions: tuple[Condition, ...]

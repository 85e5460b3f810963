"""What a scheme of the monitor gives for one block of samples."""

from dataclasses import dataclass

from monitor.signals import Condition
from rigwatch.wire.messages import EstimateBlock


@dataclass(frozen=True)
class Result:
    """What one sample block gave.

    Args:
        estimates: the published columns, one row a sample of the block that had not been seen
            before.
        conditions: one of each of `conditions.CONDITION_KINDS`, and one of clipping for each
            channel that the model can judge, of the same length.
    """

    estimates: EstimateBlock
    conditions: tuple[Condition, ...]

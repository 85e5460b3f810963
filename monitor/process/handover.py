"""What a rig and its row in a table tell each other."""

from typing import NamedTuple

from rigwatch.wire.kept_state import KeptState


class Rested(NamedTuple):
    """From where a rig's samples can be judged in a row of a table.

    Attributes:
        device, boot, following: the next sample.
        state: of the stages.
        offset_ns: the monitor's time less monotonic time [ns].
    """

    device: str
    boot: int
    following: int
    state: KeptState
    offset_ns: int


class Passed(NamedTuple):
    """What a row of a table has done.

    Attributes:
        samples: that were judged.
        boot, following: the sample after them.
        t_ns: time of the last one [ns].
        offset_ns: as in `Rested`.
        latencies_ms: time from each block to its estimates [ms].
    """

    samples: int
    boot: int
    following: int
    t_ns: int
    offset_ns: int
    latencies_ms: list[float]

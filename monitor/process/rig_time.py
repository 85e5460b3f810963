"""The time by which a monitor counts: shelves, floods and chattering last as long as they should.

Samples and operators' commands carry Unix time, of clocks that may be set, on one machine or two:

    machine's clock set forward     followed, as the samples' times do
    set back                        not followed, as the samples' times move forward
    samples ahead of the machine    the samples' time, continued by the monotonic clock
    samples behind it               the machine's: a monitor that catches up reads old samples

So it goes back only with the samples, when daq starts again or they were minutes ahead. What lasts
then ends as much sooner; after a step forward it ends early, as after a night in which the machine
slept.
"""

APART_NS = 60_000_000_000
"""Difference of two clocks above which one of them is wrong, or has been set [ns]."""


class RigTime:
    """Unix time less monotonic time, as samples and machine have it; reads no clock.

    Args:
        wall_ns, monotonic_ns: of one moment [ns].
    """

    def __init__(self, wall_ns: int, monotonic_ns: int) -> None:
        self._offset_ns = wall_ns - monotonic_ns

    def set_back(self, wall_ns: int, monotonic_ns: int, sample_ns: int | None = None) -> int:
        """By how much this time has been set back since the last call [ns], 0 if it has not.

        Args:
            wall_ns, monotonic_ns: of one moment [ns].
            sample_ns: time of a sample that has just come, None between samples [ns].
        """
        offset, before = wall_ns - monotonic_ns, self._offset_ns
        if sample_ns is None:
            offset = before if offset < before - APART_NS else offset
        elif sample_ns - wall_ns > APART_NS:
            offset = sample_ns - monotonic_ns
        self._offset_ns = offset
        return before - offset if before - offset > APART_NS else 0

    @property
    def offset_ns(self) -> int:
        """This time less monotonic time [ns]."""
        return self._offset_ns

    def is_near(self, wall_ns: int, monotonic_ns: int) -> bool:
        """Whether this time is less than a minute apart from the machine's at a moment."""
        return abs(wall_ns - monotonic_ns - self._offset_ns) <= APART_NS

    def follow(self, offset_ns: int) -> None:
        """The machine's clock has been followed to this offset, of which none was `APART_NS` back,
        by samples none of which was so far ahead.
        """
        self._offset_ns = offset_ns

    def now(self, monotonic_ns: int) -> int:
        """This time at a moment [ns]."""
        return monotonic_ns + self._offset_ns

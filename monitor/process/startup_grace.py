"""Patience at the start: silence of others who are starting too is no alarm yet.

`rigwatch up` starts all processes at once, and on a cold machine they compete for its processors.
So for a while the monitor waits for daq to appear, for its first sample, and lets the stream
settle. A rig that stays silent is told all the same, only later; a running one within
`daq.stale_after`.
"""

FOR_DAQ = 20.0
"""Longest wait for the daq process [s]."""
FOR_SAMPLES = 20.0
"""Longest wait for the first sample once daq is there [s]."""
SETTLING, HICCUP = 5.0, 1.0
"""For so long after the first sample [s], silence of so much is no alarm [s]."""


class Patience:
    """Says how long a silence counts; it is told the time and reads no clock.

    Args:
        now: when the monitor started [s].
    """

    def __init__(self, now: float) -> None:
        self._started = now
        self._daq_since: float | None = None
        self._first_sample: float | None = None

    def counted(self, now: float, silent: float, *, daq_alive: bool, heard: bool) -> float:
        """The part of a silence that may be alarmed [s].

        Args:
            now: monotonic time [s].
            silent: since the last sample, or since the start [s].
            daq_alive: whether the daq process is there.
            heard: whether a sample has ever come.
        """
        if daq_alive and self._daq_since is None:
            self._daq_since = now
        if heard and self._first_sample is None:
            self._first_sample = now
        if self._first_sample is not None:
            settling = now - self._first_sample < SETTLING
            return 0.0 if settling and silent < HICCUP else silent
        if self._daq_since is not None:
            return silent if now - self._daq_since > FOR_SAMPLES else 0.0
        return silent if now - self._started > FOR_DAQ else 0.0

"""Grace period at start-up: silence of processes that are still starting raises no alarm.

`rigwatch up` starts all processes at once, and on a cold machine they compete for its processors.
The monitor therefore waits for daq to appear, for its first sample, and for the stream to settle. A
rig that stays silent is reported after the grace period, a running one within `daq.stale_after`.
"""

FOR_DAQ = 20.0
"""Longest wait for the daq process [s]."""
FOR_SAMPLES = 20.0
"""Longest wait for the first sample once daq is running [s]."""
SETTLING, HICCUP = 5.0, 1.0
"""Settling period after the first sample, and silence allowed during it [s]."""


class Patience:
    """Decides how much of a silence counts; receives the time and reads no clock.

    Args:
        now: when the monitor started [s].
    """

    def __init__(self, now: float) -> None:
        self._started = now
        self._daq_since: float | None = None
        self._first_sample: float | None = None

    def counted(self, now: float, silent: float, *, daq_alive: bool, heard: bool) -> float:
        """The part of a silence that counts for an alarm [s].

        Args:
            now: monotonic time [s].
            silent: time since the last sample, or since the start [s].
            daq_alive: whether the daq process is running.
            heard: whether a sample has ever arrived.
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

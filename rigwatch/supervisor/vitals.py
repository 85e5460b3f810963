"""What one process has reported, and when that requires a restart.

Three failures are distinguished: the process never became ready; it is silent, so its loop hangs;
its loop runs but no sample passes although its source has samples. A process that waits for its
source or its router is healthy.
"""

import math
from dataclasses import dataclass, field

from rigwatch.wire.host import NO_ROUTER, NO_SAMPLES, WAITS


@dataclass(frozen=True, slots=True)
class Limits:
    """Time limits [s].

    Attributes:
        start: until a process is ready, including the compilation of kernels in a first run.
        silence: between two notifications of a process.
        stall: without samples while its source has them.
        patience: longest delay of a start for the processes that come before it.
        stop: from the request to stop, or the last report that it stops, to the kill.
        longest_stop: from the request to the kill, whatever is reported.
        first_pause: before the first restart; doubled for each further one.
        longest_pause: before any restart.
        settled: after running this long, a process counts as healthy again.
    """

    start: float = 120.0
    silence: float = 3.0
    stall: float = 10.0
    patience: float = 60.0
    stop: float = 8.0
    longest_stop: float = 45.0
    first_pause: float = 0.2
    longest_pause: float = 30.0
    settled: float = 10.0


@dataclass(slots=True)
class Vitals:
    """The notifications of one run of a process; all times on the supervisor's monotonic clock [s].

    Attributes:
        started_at: when it was started.
        heard_at: time of its last notification.
        ready: whether it has reported ready.
        ready_at: when it first did so; until then it may be compiling kernels.
        stopping_at: when it last reported that it is stopping.
        count: samples that passed through it since its start.
        advanced_at: when the count last increased.
        flowing_since: since when it has increased without a pause.
        status: its own status line for people.
        reads_device: whether it reads the device itself, and so knows that none is there: a
            simulated one has samples while its cable is unplugged, too.
        waited_at: when it last said that it waits for its router, or for the device it reads.
    """

    started_at: float
    reads_device: bool = False
    heard_at: float = field(init=False)
    ready: bool = False
    ready_at: float = field(init=False)
    stopping_at: float = -math.inf
    count: int = 0
    advanced_at: float = field(init=False)
    flowing_since: float = field(init=False)
    status: str = ""
    waited_at: float = -math.inf

    def __post_init__(self) -> None:
        self.heard_at = self.ready_at = self.started_at
        self.advanced_at = self.flowing_since = self.started_at

    def take(self, word: str, now: float) -> None:
        """Process one datagram of systemd's notify protocol; unknown variables are ignored."""
        self.heard_at = now
        for line in word.splitlines():
            name, _, value = line.partition("=")
            if name == "READY":
                self._is_ready(now)
            elif name == "STOPPING":
                self.stopping_at = now
            elif name == "STATUS":
                self.status = value
            elif name == "X_RIGWATCH_COUNT" and value.isdigit():
                self._count(int(value), now)
        # A simulated device that runs is not silent by itself: then daq may have the wrong line.
        absent = self.status.startswith(WAITS) and self.status != WAITS + NO_SAMPLES
        waits = self.reads_device and absent
        if waits or self.status == WAITS + NO_ROUTER:
            self.waited_at = now

    def _is_ready(self, now: float) -> None:
        if not self.ready:
            self.ready, self.ready_at = True, now

    def _count(self, count: int, now: float) -> None:
        if count <= self.count:
            return
        self._is_ready(now)
        if now - self.advanced_at > 1.0:
            self.flowing_since = now
        self.count, self.advanced_at = count, now

    def flows(self, now: float) -> bool:
        """Whether samples passed in the last second."""
        return self.count > 0 and now - self.advanced_at <= 1.0

    def serves(self, now: float, limits: Limits) -> bool:
        """Whether it has run for so long that others have taken up their links to it."""
        return self.ready and now - self.ready_at > limits.stall and now - self.heard_at <= 1.0

    def complaint(
        self,
        source: "Vitals | None",
        now: float,
        limits: Limits,
        router: "Vitals | None" = None,
    ) -> str:
        """Why the process needs a restart, empty if it does not.

        Args:
            source: the process whose samples it uses, if it runs here.
            now: monotonic time [s].
            limits: of times.
            router: that of the rig, if it runs here: a process that says that it does not answer
                is believed while that may be so.
        """
        if not self.ready:
            late = now - self.started_at > limits.start
            return f"not ready after {limits.start:g} s" if late else ""
        if now - self.heard_at > limits.silence:
            return f"hangs: silent for {limits.silence:g} s"
        if self.stalls(source, now, limits, router):
            return f"takes no samples for {limits.stall:g} s while its source has them"
        return ""

    def stalls(
        self,
        source: "Vitals | None",
        now: float,
        limits: Limits,
        router: "Vitals | None" = None,
    ) -> bool:
        """Whether it runs, and passes no samples on that its source has; see `complaint`."""
        if source is None or not source.flows(now) or not self.ready:
            return False
        dry_since = max(self.advanced_at, self.ready_at, source.flowing_since)
        if self.reads_device or router is None or not router.serves(now, limits):
            dry_since = max(dry_since, self.waited_at)
        return now - dry_since > limits.stall and now - self.heard_at <= limits.silence

"""What `rigwatch up` reports of itself to its own parent, such as systemd.

The parent starts everything anew where samples have stopped and nothing here explains it: a daq
that waits for its device, or is being started again, is no reason to end monitor and recorder.
"""

import time
from collections.abc import Callable

from rigwatch.supervisor.supervisor import Supervisor
from rigwatch.wire.host import WAITS, Heartbeat

PATIENCE = 60.0
"""Time after which a process that does not get ready keeps the others waiting no longer [s]."""
SOURCE = "daq"


class OwnHeartbeat:
    """The notifications of a supervisor.

    Args:
        supervisor: whose processes are reported.
        heartbeat: tells its parent.
        clock: seconds on a monotonic clock [s].
    """

    def __init__(
        self,
        supervisor: Supervisor,
        heartbeat: Heartbeat | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._supervisor, self._clock = supervisor, clock
        self._heartbeat = heartbeat or Heartbeat("up")
        self._patient_until = clock() + PATIENCE
        self._is_ready = False

    def turn(self, samples: int) -> None:
        """Report a turn of the loop; `samples` have come from the device since the start."""
        if not self._is_ready:
            self._get_ready()
        self._heartbeat.advance(samples, self._waits())

    def stopping(self) -> None:
        """Report that everything is being stopped."""
        self._heartbeat.stopping()

    def _get_ready(self) -> None:
        processes = self._supervisor.processes
        missing = [name for name, one in processes.items() if not one.was_ready]
        if not missing:
            self._heartbeat.ready("all processes run")
        elif self._clock() >= self._patient_until:
            self._heartbeat.ready(f"all but {', '.join(missing)} run")
        self._is_ready = not missing or self._clock() >= self._patient_until

    def _waits(self) -> str:
        """Why no samples come, where a start of everything anew would bring none."""
        source = self._supervisor.processes.get(SOURCE)
        if source is None:
            return "samples come from elsewhere"
        if source.state != "running":
            return f"{SOURCE} is {source.state}"
        status = source.vitals.status
        return status.removeprefix(WAITS) if status.startswith(WAITS) else ""

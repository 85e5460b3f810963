"""One rig from its device to the bus."""

import time

from daq.acquisition import Acquisition
from daq.adapter import Adapter
from daq.device_desk import DeviceDesk
from daq.known_device import KnownDevice, device_file
from daq.publisher import Publisher
from daq.supervisor import Supervisor
from daq.watch import OPEN, Link
from rigwatch.wire.bus import Bus
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.host import DEVICE_SILENT, NO_SAMPLES, Pulse
from rigwatch.wire.rig_config import RigConfig


class Chain:
    """One rig from its device to the bus; `step` takes what has come one link further.

    Args:
        config: the rig's configuration.
        adapter: its device, not opened yet.
        bus: destination of its samples.
        pulse: told of each step.

    Attributes:
        taken: whether what the device has sent was published with that of other rigs already
            (`daq.together`), so that the next step does not read it.
        seat: what those tables keep of this rig.
        failure: what went wrong there, which the next step raises.
    """

    def __init__(self, config: RigConfig, adapter: Adapter, bus: Bus, pulse: Pulse) -> None:
        self.device = Supervisor(adapter)
        self.acquisition = Acquisition(config, adapter.clock_rate)
        self.publisher = Publisher(bus, SampleRing(bus, config.daq.ring))
        self.adapter, self._pulse, self._bus = adapter, pulse, bus
        self._known = _checked(config, adapter, self.acquisition.source)
        self._desk = DeviceDesk(bus, self._known, config.bus.security) if self._known else None
        self.taken = False
        self.seat: object = None
        self.failure: Exception | None = None

    def step(self, wait: float) -> None:
        """Read for at most `wait` [s] and publish what comes of it."""
        if self.failure is not None:
            raise self.failure
        taken, self.taken = self.taken, False
        if not taken:
            for raw in self.device.read(wait):
                self.publisher.publish(self.acquisition.update(raw))
        now_ns = time.monotonic_ns()
        link = OPEN if taken else self.device.link
        if not taken or not self.acquisition.tick_quietly(now_ns):
            self._tick(now_ns)
        self._pulse.advance(self.acquisition.samples, _waits(link, self.acquisition.watch.state))

    def _tick(self, now_ns: int) -> None:
        counters = self.adapter.counters()
        if self._known and self._desk:
            self.publisher.publish(self._known.events())
            counters = {**counters, **self._desk.counters}
        counters = {**counters, "questions_refused": float(self._bus.questions_refused)}
        self.publisher.publish(self.acquisition.tick(now_ns, self.device.link, counters))


def _waits(link: Link, state: str) -> str:
    """Why no samples come of the device, whose line a start anew would only open again."""
    if not link.connected or link.text:
        return link.text or "the device is not open"
    return NO_SAMPLES if state in DEVICE_SILENT else ""


def _checked(config: RigConfig, adapter: Adapter, source: str) -> KnownDevice | None:
    """The rig's device as it is known, which the adapter checks; None where nothing is checked."""
    check_against = getattr(adapter, "check_against", None)
    named = getattr(config.daq.device, "identity", "")
    if check_against is None or named or config.daq.any_device:
        return None
    known = KnownDevice(source, device_file(config))
    check_against(known)
    return known

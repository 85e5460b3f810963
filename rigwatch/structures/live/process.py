"""Monitors a structure on a rig's bus: the loop around `live_watch.LiveDamage`."""

import time

from rigwatch.structures.live.live_watch import LiveDamage
from rigwatch.wire.bus import Bus, joined
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.errors import ModelError
from rigwatch.wire.host import set_at_signal, unless_ended
from rigwatch.wire.messages import HEALTH, Health, SampleBlock, topic_of
from rigwatch.wire.rig_config import RigConfig

TURN = 0.1
"""Longest wait for samples [s]."""
HEALTH_EVERY = 1.0
PROCESS = "structure"


class StructureProcess:
    """The resources of one run.

    Args:
        bus: where samples come from and results go.
        watched: the structure.
        history: number of samples to fetch from the ring before the first one received: a
            structure's record begins when its device starts.
    """

    def __init__(self, bus: Bus, watched: LiveDamage, history: int) -> None:
        self._bus, self._watched = bus, watched
        self._told, self._unsuitable = 0.0, ""
        self.reader = SampleReader(bus, history=history)

    def turn(self, timeout: float = TURN) -> None:
        """Process the samples received, waiting at most `timeout` [s]."""
        for item in self.reader.read(timeout):
            if isinstance(item, SampleBlock):
                self._take(item)
        if time.monotonic() - self._told >= HEALTH_EVERY:
            self._told = time.monotonic()
            self._bus.publish(HEALTH, self._health())

    def close(self) -> None:
        """Close the connection to the bus."""
        self.reader.close()

    def _take(self, block: SampleBlock) -> None:
        try:
            said = self._watched.update(block)
        except ModelError as error:
            self._unsuitable = str(error)
            return
        self._unsuitable = ""
        for message in said:
            self._bus.publish(topic_of(message), message)

    def _health(self) -> Health:
        counters = {"delivered": float(self.reader.counters.delivered)}
        # What stays unwatched is not told as running, however well the process runs.
        idle = self._watched.idle
        state = "unsuitable" if self._unsuitable else "unwatched" if idle else "running"
        return Health(PROCESS, time.time_ns(), state, self._unsuitable or idle, counters)


def watch_rig(config: RigConfig, watched: LiveDamage) -> None:
    """Monitor the rig until a signal ends the process.

    Raises:
        BusError: the bus cannot be joined.
    """
    stop = set_at_signal()
    unless_ended(stop, watched.prepare)
    with joined(config, PROCESS, stop) as bus:
        if bus is None:
            return
        process = StructureProcess(bus, watched, config.daq.ring)
        while not stop.is_set():
            process.turn()
        process.close()

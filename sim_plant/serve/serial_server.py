"""The device on a serial line: frames at the sample rate, in real time."""

import threading

from rigwatch.wire.device import Frame, encode
from rigwatch.wire.host import Heartbeat
from sim_plant.serve.line_faults import LineFaults
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.source import Device, Pace, Sent


class SerialServer:
    """Sends each sample of `device` when it is due.

    Args:
        device: the device.
        line: the line, plugged and unplugged by the faults.
        rate: sample rate [Hz].
        faults: faults of the line; None for none.
        heartbeat: called with the number of samples sent; None for none.
    """

    def __init__(
        self,
        device: Device,
        line: PtyLine,
        rate: float = 256.0,
        faults: LineFaults | None = None,
        heartbeat: Heartbeat | None = None,
    ) -> None:
        self.device = device
        self.line = line
        self.faults = faults or LineFaults()
        self.sent = 0
        self._rate = rate
        self._heartbeat = heartbeat or Heartbeat("plant", {})

    def run(self, stop: threading.Event) -> None:
        """Serve until `stop` is set."""
        pace = Pace(self._rate)
        with self.line:
            self._heartbeat.ready(f"serial frames at {self.line.link}")
            while not stop.wait(pace.until_next()):
                self.step(pace.due())
                self._heartbeat.advance(self.sent)

    def step(self, n: int) -> None:
        """Send the next n samples now."""
        if n < 1:
            return
        for frame in frames(self.device.advance(n)):
            self.faults.switch(self.line)
            self.line.write(self.faults.apply(encode(frame)))
        self.sent += n


def frames(sent: Sent) -> list[Frame]:
    """One frame a sample."""
    rows = zip(sent.seq.tolist(), sent.device_us.tolist(), sent.codes.tolist(), strict=True)
    return [Frame(sent.boot, seq, us, tuple(codes)) for seq, us, codes in rows]

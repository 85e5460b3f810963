"""The list of standing alarms, served by the monitor on request."""

import contextlib
from collections.abc import Callable, Sequence

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.transport import Close
from rigwatch.wire.errors import BusError, MessageError
from rigwatch.wire.messages import Alarm, decode, encode

KEY = "monitor/standing"
_MARK = b"alarms"
"""First entry of every list, so that an empty list differs from no reply."""


def serve_alarm_list(bus: Bus, standing: Callable[[], Sequence[Alarm]]) -> Close:
    """Reply with the result of `standing()`, which is called in a thread of the bus."""
    return bus.serve(KEY, lambda _: [_MARK, *(encode(alarm) for alarm in standing())])


def ask_alarm_list(bus: Bus, timeout: float = 1.0) -> list[Alarm]:
    """The standing alarms, first-out first.

    Raises:
        BusError: no monitor answers.
    """
    replies = bus.query(KEY, timeout=timeout)
    if _MARK not in replies:
        raise no_monitor(bus)
    alarms = []
    for reply in replies:
        with contextlib.suppress(MessageError):
            alarms += [decode(Alarm, reply)] if reply != _MARK else []
    return sorted(alarms, key=lambda alarm: (not alarm.first_out, alarm.t_ns))


def no_monitor(bus: Bus) -> BusError:
    """The error that nobody is there who could execute a command."""
    return BusError(f"no monitor of rig {bus.rig} answers: start `rigwatch monitor`")

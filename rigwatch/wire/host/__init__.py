"""Services of the operating system: systemd notifications, real-time priority, ports, signals."""

from rigwatch.wire.host.ending import set_at_signal
from rigwatch.wire.host.heartbeat import Heartbeat
from rigwatch.wire.host.ports import endpoint_address, free_port, is_free
from rigwatch.wire.host.realtime import DAQ, MONITOR, ROUTER, prepare_for_real_time, raise_priority

__all__ = [
    "DAQ",
    "MONITOR",
    "ROUTER",
    "Heartbeat",
    "endpoint_address",
    "free_port",
    "is_free",
    "prepare_for_real_time",
    "raise_priority",
    "set_at_signal",
]

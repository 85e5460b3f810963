"""The host: notifications, priority, threads, ports, signals, files, output, locks, clocks."""

from rigwatch.wire.host.both_clocks import both_clocks
from rigwatch.wire.host.disk_space import free_share
from rigwatch.wire.host.ending import set_at_hangup, set_at_signal, unless_ended
from rigwatch.wire.host.few_pools import (
    keep_large_pieces_apart,
    keep_memory_tidy,
    settle_memory,
    tidy_memory,
    use_few_pools,
)
from rigwatch.wire.host.file_presence import may_be_file
from rigwatch.wire.host.heartbeat import (
    DEVICE_SILENT,
    NO_ROUTER,
    NO_SAMPLES,
    WAITS,
    Heartbeat,
    waits_for_samples,
    waits_of,
)
from rigwatch.wire.host.one_keeper import Hold, Kept
from rigwatch.wire.host.ports import endpoint_address, free_port, free_ports, is_free
from rigwatch.wire.host.printer import Printer
from rigwatch.wire.host.processes import end_process, end_with_parent, last_line
from rigwatch.wire.host.ready_files import ready_to_read, write_within
from rigwatch.wire.host.realtime import (
    DAQ,
    MONITOR,
    ROUTER,
    be_idle,
    prepare_for_real_time,
    raise_priority,
)
from rigwatch.wire.host.side_by_side import Part, Pulse, RigPulse, Work, run_side_by_side
from rigwatch.wire.host.turns import Turns
from rigwatch.wire.host.whole_file import replace_file, write_through

__all__ = [
    "DAQ",
    "DEVICE_SILENT",
    "MONITOR",
    "NO_ROUTER",
    "NO_SAMPLES",
    "ROUTER",
    "WAITS",
    "Heartbeat",
    "Hold",
    "Kept",
    "Part",
    "Printer",
    "Pulse",
    "RigPulse",
    "Turns",
    "Work",
    "be_idle",
    "both_clocks",
    "end_process",
    "end_with_parent",
    "endpoint_address",
    "free_port",
    "free_ports",
    "free_share",
    "is_free",
    "keep_large_pieces_apart",
    "keep_memory_tidy",
    "last_line",
    "may_be_file",
    "prepare_for_real_time",
    "raise_priority",
    "ready_to_read",
    "replace_file",
    "run_side_by_side",
    "set_at_hangup",
    "set_at_signal",
    "settle_memory",
    "tidy_memory",
    "unless_ended",
    "use_few_pools",
    "waits_for_samples",
    "waits_of",
    "write_through",
    "write_within",
]

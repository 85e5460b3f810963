"""Several rigs in one process: each has a thread, which reads its device or has it read.

A device that hangs, is unplugged or does not match its configuration delays no other: it is opened
in its rig's thread, and read there too unless reading it never waits (`turns.py`). Samples are
taken in turns: most of the cost of a sample is that of the calls around it, and a message of a turn
costs daq, bus, monitor and recorder little more than that of one sample. What simply follows is
taken for the rigs of a turn together (`together`).
"""

import threading
from functools import partial
from pathlib import Path

from daq.__main__ import acquire
from daq.adapters import adapter_for
from daq.together import Lane
from rigwatch.wire.bus import SharedLinks, joined
from rigwatch.wire.host import (
    DAQ,
    Heartbeat,
    Part,
    RigPulse,
    Turns,
    Work,
    prepare_for_real_time,
    raise_priority,
    run_side_by_side,
    set_at_hangup,
    set_at_signal,
    unless_ended,
)
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.several_rigs import valid_rigs
from rigwatch.wire.typed_files import Section

TURN = 0.035
"""Time from one reading of a device to the next: a sample waits for half of it on average [s]."""


def work_of(path: Path, links: SharedLinks, turns: Turns) -> Work:
    """The acquisition of one rig."""

    def work(stop: threading.Event, pulse: RigPulse) -> None:
        config = load_rig(path)
        adapter = adapter_for(config.daq.device, config.channels)
        with joined(config, "daq", stop, pulse.say, links) as bus:
            if bus is not None:
                acquire(config, adapter, bus, stop, pulse, turns=turns)

    return work


def used(path: Path) -> tuple[Section, ...]:
    """What the acquisition of a rig depends on."""
    config = load_rig(path)
    return config.rig, config.bus, config.daq, *config.channels


def run_several(paths: list[Path]) -> int:
    """Acquire from the rigs at `paths` until a signal ends it; the exit code.

    Raises:
        ConfigError: no configuration is valid, or two are of one rig.
    """
    stop = set_at_signal()
    valid_rigs(paths)  # a wrong file is named by its rig's thread
    raise_priority(DAQ)
    prepare_for_real_time()
    links = SharedLinks(len(paths))
    turns = Turns(TURN, links.together, before=unless_ended(stop, Lane).take)
    parts = [Part(str(path), work_of(path, links, turns), partial(used, path)) for path in paths]
    run_side_by_side(parts, Heartbeat("daq"), stop, set_at_hangup())
    links.close()
    return 0

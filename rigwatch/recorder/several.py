"""Several rigs in one recorder process; those of one disk take turns (`disk_turns`).

Each rig begins and ends in a thread of its own: a session that takes long to go on with delays no
other, and a disk that hangs delays those of no other disk.
"""

import threading
from functools import partial
from pathlib import Path

from rigwatch.recorder.disk_turns import DiskTurns
from rigwatch.recorder.process import PROCESS, describe_run, process_name, record
from rigwatch.wire.bus import SharedLinks, joined
from rigwatch.wire.host import (
    Heartbeat,
    Part,
    RigPulse,
    Work,
    keep_memory_tidy,
    run_side_by_side,
    set_at_hangup,
    use_few_pools,
)
from rigwatch.wire.rig_config import load_rig, rig_text
from rigwatch.wire.several_rigs import valid_rigs

MANY = 32
"""Rigs from which on blocks are read by a compiled call: the compiler takes 130 MB once."""


def work_of(
    path: Path, notes: str, folders: dict[Path, Path], links: SharedLinks, disks: DiskTurns
) -> Work:
    """The recording of one rig; it writes its session's folder into `folders` at its end."""

    def work(stop: threading.Event, pulse: RigPulse) -> None:
        config = load_rig(path)
        with joined(config, process_name(config), stop, pulse.say, links) as bus:
            if bus is not None:
                run = describe_run(path, config, notes)
                folders[path] = record(config, run, bus, stop, pulse, disks=disks)

    return work


def used(path: Path) -> str:
    """What the recording of a rig depends on: every key, as its session carries them."""
    load_rig(path)
    return rig_text(path)


def run_several(paths: list[Path], stop: threading.Event, notes: str = "") -> list[Path]:
    """Record the rigs at `paths` until `stop` is set; the folders of the last sessions.

    Raises:
        ConfigError: no configuration is valid, or two are of one rig.
    """
    use_few_pools()
    if len(paths) >= MANY:
        from rigwatch.wire.quick_joining import join_quickly  # with the compiler

        join_quickly()
    folders: dict[Path, Path] = {}
    valid_rigs(paths)  # a wrong file is named by its rig's thread
    keep_memory_tidy(stop)
    links = SharedLinks(len(paths))
    disks = DiskTurns(links.together)
    parts = [
        Part(str(path), work_of(path, notes, folders, links, disks), partial(used, path))
        for path in paths
    ]
    run_side_by_side(parts, Heartbeat(PROCESS), stop, set_at_hangup())
    links.close()
    return [folders[path] for path in paths if path in folders]

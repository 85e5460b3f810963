"""Several rigs in one recorder process, each in a thread of its own.

A disk that hangs or a session that takes long to go on with delays no other rig.
"""

import threading
from pathlib import Path

from rigwatch.recorder.process import PROCESS, describe_run, record
from rigwatch.wire.bus import joined
from rigwatch.wire.host import Heartbeat, Part, RigPulse, Work, run_side_by_side
from rigwatch.wire.rig_config import RigConfig, load_rigs


def work_of(path: Path, config: RigConfig, notes: str, folders: dict[Path, Path]) -> Work:
    """The recording of one rig; it writes its session's folder into `folders` at its end."""

    def work(stop: threading.Event, pulse: RigPulse) -> None:
        with joined(config, PROCESS, stop, pulse.say) as bus:
            if bus is not None:
                run = describe_run(path, config, notes)
                folders[path] = record(config, run, bus, stop, pulse)

    return work


def run_several(paths: list[Path], stop: threading.Event, notes: str = "") -> list[Path]:
    """Record the rigs at `paths` until `stop` is set; the folders of the sessions.

    Raises:
        ConfigError: a configuration is invalid, or two are of one rig.
    """
    folders: dict[Path, Path] = {}
    rigs = load_rigs(paths)
    parts = [Part(str(path), work_of(path, config, notes, folders)) for path, config in rigs]
    run_side_by_side(parts, Heartbeat(PROCESS), stop)
    return [folders[path] for path in paths if path in folders]

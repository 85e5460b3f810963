"""Follows the configuration while the rig runs: a change restarts the processes it concerns.

    file changed ─▶ settled ─▶ read ─┬─ wrong: reported with its line, nothing is restarted
                                     └─ valid: reported, processes of changed sections restarted

A recorder is restarted by every change, as a session carries the hash of its configuration. A daq
or recorder of several rigs restarts the changed rig by itself, so that the others continue.
"""

import time
from collections.abc import Callable
from pathlib import Path

from rigwatch.supervisor.plan import PROCESSES, ProcessPlan
from rigwatch.supervisor.settled_file import SettledFile
from rigwatch.supervisor.supervisor import Supervisor
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import RigConfig, load_rig

INTERVAL = 0.5
"""Time between two checks of the file [s]."""
_OF_ALL = ("rig", "bus", "channels")
"""Sections that every process uses."""


class ConfigWatch:
    """The configuration of the rig that a supervisor runs.

    Args:
        path: its file.
        config: as it was read.
        supervisor: restarts the processes.
        tell: called with one line for each change.
        read: reads the file, and raises `ConfigError` if it is wrong.
        follow: called with path and configuration to start and end processes that it has more or
            less than before.
        clock: seconds on a monotonic clock [s].
    """

    def __init__(
        self,
        path: Path | str,
        config: RigConfig,
        supervisor: Supervisor,
        tell: Callable[[str], None],
        *,
        read: Callable[[Path], RigConfig] = load_rig,
        follow: Callable[[Path, RigConfig], None] = lambda _path, _config: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._path, self._config, self._supervisor = Path(path), config, supervisor
        self._tell, self._load, self._follow, self._clock = tell, read, follow, clock
        self._file, self._checked_at = SettledFile(self._path), clock()

    def check(self) -> None:
        """Check the file if it is due, and act on a change."""
        if self._clock() - self._checked_at < INTERVAL:
            return
        self._checked_at = self._clock()
        if not self._file.has_new_content():
            return
        try:
            self._take(self._load(self._path))
        except ConfigError as error:
            self._tell(f"{error}; everything runs on as it was configured before")

    def _take(self, config: RigConfig) -> None:
        roles = affected(self._config, config)
        self._config = config
        before = self._plans()
        self._follow(self._path, config)
        now = self._plans()
        started = [one for name, one in now.items() if one != before.get(name)]
        ended = [one for name, one in before.items() if name not in now]
        concerned = [
            one
            for one in now.values()
            if one not in started and one.role in roles and one.reads(str(self._path))
        ]
        for one in concerned:
            act = self._supervisor.renew if one.renews else self._supervisor.restart
            act(one.name, f"the configuration {self._path.name} has changed")
        anew = ", ".join(one.name for one in (*started, *concerned))
        gone = f"; ended: {', '.join(one.name for one in ended)}" if ended else ""
        self._tell(f"{self._path} has changed; started anew: {anew or 'nothing'}{gone}")

    def _plans(self) -> dict[str, ProcessPlan]:
        return {name: one.child.plan for name, one in self._supervisor.processes.items()}


def affected(before: RigConfig, after: RigConfig) -> set[str]:
    """The processes whose sections differ; all of them if a common section does."""
    if any(getattr(before, name) != getattr(after, name) for name in _OF_ALL):
        return set(PROCESSES)
    sections = set(PROCESSES) - {"router"}
    changed = {name for name in sections if getattr(before, name) != getattr(after, name)}
    return changed | {"recorder"} if changed else changed

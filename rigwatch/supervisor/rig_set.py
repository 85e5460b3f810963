"""The rigs that one supervisor runs: a rig joins once its file is valid, and leaves with its file.

file left out ─▶ changed and right ─▶ its rig joins     \\
file of a rig ─▶ removed           ─▶ its rig leaves     ├▶ the supervisor follows the new plans
file of a rig ─▶ section more, less ─▶ a process more, less /
"""

import time
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from rigwatch.supervisor.config_watch import INTERVAL, ConfigWatch
from rigwatch.supervisor.plan import ProcessPlan, plan
from rigwatch.supervisor.settled_file import SettledFile
from rigwatch.supervisor.several import plan_several
from rigwatch.supervisor.supervisor import Supervisor
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.host import may_be_file
from rigwatch.wire.rig_config import RigConfig, load_rig
from rigwatch.wire.several_rigs import Rigs, valid_rigs

GONE_AFTER = 3.0
"""Time without its file after which a rig leaves; an editor replaces files [s]."""


class RigSet:
    """The rigs at some paths, and the watches of their files.

    Args:
        paths: all configurations, wrong ones included.
        rigs: those that are valid.
        without: processes to omit.
        supervisor: runs the processes.
        tell: called with one line for each change.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        rigs: Rigs,
        without: Collection[str],
        supervisor: Supervisor,
        tell: Callable[[str], None],
    ) -> None:
        self._paths, self._without = paths, without
        self._supervisor, self._tell = supervisor, tell
        self._rigs = dict(rigs)
        self._watches = {path: self._watch(path, config) for path, config in rigs}
        self._wrong = {path: SettledFile(path) for path in paths if path not in self._rigs}
        self._there = dict.fromkeys(paths, time.monotonic())
        self._checked_at = time.monotonic()

    def check(self) -> None:
        """Check the files if it is due, and act on changes."""
        for watch in self._watches.values():
            watch.check()
        now = time.monotonic()
        if now - self._checked_at < INTERVAL or len(self._paths) == 1:
            return
        self._checked_at = now
        self._there |= {path: now for path in self._paths if may_be_file(path)}
        for path in self._paths:
            if path in self._wrong:
                self._join(path)
            elif now - self._there[path] > GONE_AFTER and len(self._rigs) > 1:
                self._leave(path)

    def _join(self, path: Path) -> None:
        if not self._wrong[path].has_new_content():
            return
        try:
            config = self._read(path)
            plan_several([*self._rigs.items(), (path, config)], self._without)
        except ConfigError as error:
            self._tell(f"{error}; this rig is left out")
            return
        del self._wrong[path]
        self._watches[path] = self._watch(path, config)
        self._tell(f"{path} is right now: rig {config.rig.id} joins")
        self._follow(path, config)

    def _leave(self, path: Path) -> None:
        del self._watches[path]
        self._wrong[path] = SettledFile(path, known=False)
        self._tell(f"{path} is gone: rig {self._rigs.pop(path).rig.id} leaves")
        self._supervisor.follow(self._plans())

    def _watch(self, path: Path, config: RigConfig) -> ConfigWatch:
        read, follow = self._read, self._follow
        return ConfigWatch(path, config, self._supervisor, self._tell, read=read, follow=follow)

    def _read(self, path: Path) -> RigConfig:
        """One of the files, which must still be of a rig of its own."""
        config = load_rig(path)
        valid_rigs(self._paths)
        return config

    def _follow(self, path: Path, config: RigConfig) -> None:
        self._rigs[path] = config
        self._supervisor.follow(self._plans())

    def _plans(self) -> list[ProcessPlan]:
        return planned(self._paths, list(self._rigs.items()), self._without)


def planned(paths: Sequence[Path], rigs: Rigs, without: Collection[str]) -> list[ProcessPlan]:
    """The processes of the rigs at `paths`, in starting order."""
    if len(paths) == 1:
        (path, config), *_ = rigs
        return plan(config, path, without)
    return plan_several([rig for path in paths for rig in rigs if rig[0] == path], without)

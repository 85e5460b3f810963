"""The processes that a rig's configuration asks for, in starting order."""

import sys
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from rigwatch.wire.rig_config import RigConfig


@dataclass(frozen=True, slots=True)
class ProcessPlan:
    """One process of a rig.

    Attributes:
        name: name in events and in the status line.
        arguments: the command and its arguments.
        source: the process whose samples it uses, empty if there is none here.
        may_finish: exit code 0 is intended, such as a viewer closed by its user.
        after: processes that get time to become ready before its first start.
        renews: it starts a rig anew on SIGHUP, without a restart.
    """

    name: str
    arguments: tuple[str, ...]
    source: str = ""
    may_finish: bool = False
    after: tuple[str, ...] = ()
    renews: bool = False

    @property
    def role(self) -> str:
        """What it is, such as "plant", without the rig that a name among several rigs has."""
        return self.name.partition(" ")[0]

    def reads(self, file: str) -> bool:
        """Whether it reads this configuration."""
        return file in self.arguments


PROCESSES = ("router", "plant", "daq", "monitor", "recorder", "witness", "dashboard")
COMMANDS = {"recorder": "record"}
READERS = ("daq", "monitor", "recorder")
"""A simulated device waits for readers that want its first sample."""


def plan(config: RigConfig, path: Path | str, without: Collection[str] = ()) -> list[ProcessPlan]:
    """The processes of the rig at `path`, each a command of `rigwatch` with that file."""
    return [
        ProcessPlan(
            name=name,
            arguments=arguments(name, [path]),
            source=_source(name, config, without),
            may_finish=name == "dashboard",
            after=READERS if name == "plant" else (),
        )
        for name in PROCESSES
        if name not in without and is_wanted(name, config)
    ]


def arguments(name: str, paths: Sequence[Path | str]) -> tuple[str, ...]:
    """The command line of the process `name` of the rigs at `paths`."""
    return (sys.executable, "-m", "rigwatch", COMMANDS.get(name, name), *map(str, paths))


def is_wanted(name: str, config: RigConfig) -> bool:
    """Whether a rig's configuration asks for the process `name`."""
    return name in ("router", "daq") or getattr(config, name) is not None


def _source(name: str, config: RigConfig, without: Collection[str]) -> str:
    if name == "daq":
        source = "plant" if config.plant is not None else ""
    else:
        source = "daq" if name in ("monitor", "recorder", "dashboard") else ""
    return "" if source in without else source

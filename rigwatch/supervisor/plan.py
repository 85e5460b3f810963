"""The processes that a rig's configuration asks for, in starting order."""

import sys
from collections.abc import Collection
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
    """

    name: str
    arguments: tuple[str, ...]
    source: str = ""
    may_finish: bool = False
    after: tuple[str, ...] = ()


PROCESSES = ("router", "plant", "daq", "monitor", "recorder", "witness", "dashboard")
_COMMANDS = {"recorder": "record"}
_READERS = ("daq", "monitor", "recorder")
"""A simulated device waits for readers that want its first sample."""


def plan(config: RigConfig, path: Path | str, without: Collection[str] = ()) -> list[ProcessPlan]:
    """The processes of the rig at `path`, each a command of `rigwatch` with that file."""
    return [
        ProcessPlan(
            name=name,
            arguments=(sys.executable, "-m", "rigwatch", _COMMANDS.get(name, name), str(path)),
            source=_source(name, config, without),
            may_finish=name == "dashboard",
            after=_READERS if name == "plant" else (),
        )
        for name in PROCESSES
        if name not in without and _is_wanted(name, config)
    ]


def _is_wanted(name: str, config: RigConfig) -> bool:
    return name in ("router", "daq") or getattr(config, name) is not None


def _source(name: str, config: RigConfig, without: Collection[str]) -> str:
    if name == "daq":
        source = "plant" if config.plant is not None else ""
    else:
        source = "daq" if name in ("monitor", "recorder", "dashboard") else ""
    return "" if source in without else source

"""The processes of several rigs: one daq, monitor and recorder for all of them.

    a router for each endpoint · plant of each rig · daq · monitor · recorder · witness of each rig

A simulated device and a witness belong to one rig: the first stands for its hardware, the second
watches the monitor from outside. The dashboard shows one rig and is started by hand.
"""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from rigwatch.supervisor.plan import READERS, ProcessPlan, arguments, is_wanted
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.several_rigs import Rigs

RENEWING = ("daq", "recorder")
SHARED = ("daq", "monitor", "recorder")


def plan_several(rigs: Rigs, without: Collection[str] = ()) -> list[ProcessPlan]:
    """The processes of several rigs in starting order.

    Raises:
        ConfigError: two rigs share a router with keys, which serves one rig.
    """
    routers = [_one("router", *rig) for rig in _routers(rigs)]
    if len(routers) == 1:
        routers = [replace(routers[0], name="router")]
    plants = [_one("plant", *rig) for rig in _having("plant", rigs)]
    witnesses = [_one("witness", *rig) for rig in _having("witness", rigs)]
    shared = [_shared(name, found) for name in SHARED if (found := _having(name, rigs))]
    every = [*routers, *plants, *shared, *witnesses]
    return [plan for plan in every if plan.role not in without]


def _having(name: str, rigs: Rigs) -> list[tuple[Path, RigConfig]]:
    return [(path, config) for path, config in rigs if is_wanted(name, config)]


def _routers(rigs: Rigs) -> list[tuple[Path, RigConfig]]:
    """One rig for each endpoint on which a router listens."""
    found: dict[str, tuple[Path, RigConfig]] = {}
    for path, config in rigs:
        other, first = found.setdefault(config.bus.listen, (path, config))
        if other is not path and (config.bus.security.keys or first.bus.security.keys):
            expected = "one of its own: a router with keys serves one rig"
            raise ConfigError(path, "bus.listen", f"the address of {other}", expected)
    return list(found.values())


def _one(name: str, path: Path, config: RigConfig) -> ProcessPlan:
    """A process of one rig."""
    after = READERS if name == "plant" else ()
    return ProcessPlan(f"{name} {config.rig.id}", arguments(name, [path]), after=after)


def _shared(name: str, rigs: Rigs) -> ProcessPlan:
    """A process of all these rigs."""
    source = "" if name == "daq" else "daq"
    command = arguments(name, [path for path, _ in rigs])
    return ProcessPlan(name, command, source, renews=name in RENEWING and len(rigs) > 1)

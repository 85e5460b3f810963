"""A rig with keys on loopback, and operators ann and bob."""

from pathlib import Path

from rigwatch.keys import Authority
from rigwatch.wire.access import ROLES, Signer
from rigwatch.wire.bus import Bus
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.rig_config import RigConfig, load_rig
from tests.bus.rig import TestRig

OPERATORS = ("ann", "bob")


def make_keys(folder: Path, rig: str = "bench") -> Path:
    """A folder of keys for all roles and two operators."""
    authority = Authority.create(folder, rig)
    for role in ROLES:
        authority.issue(role, role)
    for name in OPERATORS:
        authority.issue(name, "operator")
    return folder


class SecuredRig(TestRig):
    """A rig whose processes and operators have keys."""

    __test__ = False

    def __init__(self, folder: Path, keys: Path, extra: str = "") -> None:
        self.keys = keys
        super().__init__(folder, extra)

    def configure(self, name: str, router: int, extra: str = "") -> Path:
        """The configuration of operator ann's machine."""
        path = super().configure(name, router, extra)
        text = path.read_text().replace("tcp/", "tls/")
        section = f'[bus.security]\nkeys = "{self.keys}"\noperator = "ann"\n\n[[channels]]'
        path.write_text(text.replace("[[channels]]", section, 1))
        return path

    def of(self, operator: str) -> RigConfig:
        """The configuration on another operator's machine."""
        path = self.folder / f"{operator}.toml"
        path.write_text(self.path.read_text().replace('"ann"', f'"{operator}"'))
        return load_rig(path)


def operator_bus(network: MemoryNetwork, keys: Path, name: str) -> Bus:
    """An operator's bus in memory, with the operator's key."""
    return network.bus("bench", f"ack-{name}", Signer(keys, name))

"""The register of a rig's certificates, and the files of a folder of keys."""

from pathlib import Path

import msgspec

from rigwatch.wire.errors import KeysError, reason_of
from rigwatch.wire.typed_files import JsonError, json_value

REGISTER = "register.json"
ROLES = ("router", "device", "daq", "monitor", "recorder", "witness", "dashboard", "operator")


class Issued(msgspec.Struct, frozen=True):
    """A certificate: owner, role, serial number, expiry date, and whether it is revoked."""

    name: str
    role: str
    serial: int
    ends: str
    revoked: bool = False

    @property
    def common_name(self) -> str:
        """The certificate's unique common name."""
        return f"{self.name}.{self.serial}"


class Register(msgspec.Struct, frozen=True):
    """The certificates issued by a rig's authority."""

    rig: str
    issued: tuple[Issued, ...]

    def find(self, common_name: str) -> Issued | None:
        """The certificate with this common name."""
        return next((one for one in self.issued if one.common_name == common_name), None)


def read_register(folder: Path) -> Register:
    """The register in a folder of keys.

    Raises:
        KeysError: it cannot be read.
    """
    path = folder / REGISTER
    try:
        return json_value(path.read_bytes(), Register)
    except (OSError, JsonError) as error:
        raise KeysError(f"{path}: register cannot be read: {reason_of(error)}") from None


def authority_file(folder: Path) -> Path:
    """The authority's certificate."""
    return folder / "authority.pem"


def key_files(folder: Path, name: str) -> tuple[Path, Path]:
    """Paths of the certificate and the private key of a name."""
    return folder / f"{name}.pem", folder / f"{name}.key"

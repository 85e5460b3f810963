"""Issues and revokes certificates (X.509, ECDSA P-256) with the library `cryptography`.

The common name of a certificate is `<name>.<serial>`. The router admits the common names that the
register lists as valid, so a revoked certificate stays invalid when its name is issued again.
"""

import fcntl
import ipaddress
import os
import re
import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from rigwatch.wire.access import (
    REGISTER,
    ROLES,
    Issued,
    Register,
    authority_file,
    key_files,
    read_register,
)
from rigwatch.wire.errors import KeysError, reason_of
from rigwatch.wire.host import replace_file
from rigwatch.wire.typed_files import json_value

AUTHORITY_KEY = "authority.key"
LONGEST_NAME = 40  # a common name holds 64 characters, with what stands around the name
_NAME = re.compile(rf"[A-Za-z0-9_-]{{1,{LONGEST_NAME}}}")
AUTHORITY_DAYS, CERTIFICATE_DAYS = 3650, 730


class Authority:
    """The authority in a folder of keys.

    Args:
        folder: made by `create`.

    Raises:
        KeysError: there is none, or it cannot be read.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            self.register = json_value((folder / REGISTER).read_bytes(), Register)
            self._certificate = x509.load_pem_x509_certificate(authority_file(folder).read_bytes())
            key = serialization.load_pem_private_key((folder / AUTHORITY_KEY).read_bytes(), None)
        except (OSError, ValueError) as error:
            why = reason_of(error)
            made = f"make one with `rigwatch keys new {folder}`"
            raise KeysError(f"{folder}: found no authority ({why}); {made}") from None
        assert isinstance(key, ec.EllipticCurvePrivateKey)
        self._key = key

    @classmethod
    def create(cls, folder: Path, rig: str) -> "Authority":
        """A new authority for `rig` in `folder`.

        Raises:
            KeysError: the rig's name is none, or the folder holds one already or cannot be written.
        """
        _check_name("rig", rig)
        if (folder / REGISTER).exists():
            raise KeysError(f"{folder}: holds an authority already, expected a new folder")
        key = ec.generate_private_key(ec.SECP256R1())
        name = _name(f"rigwatch authority of {rig}")
        ends = datetime.now(UTC) + timedelta(days=AUTHORITY_DAYS)
        builder = _builder(name, name, key, ends)
        builder = builder.add_extension(
            x509.BasicConstraints(ca=True, path_length=0), critical=True
        )
        certificate = builder.sign(key, hashes.SHA256())
        _write(folder, AUTHORITY_KEY, _private(key), secret=True)
        _write(folder, authority_file(folder).name, _pem(certificate))
        _write(folder, REGISTER, msgspec.json.encode(Register(rig, ())))
        return cls(folder)

    def issue(self, name: str, role: str, addresses: Iterable[str] = ()) -> Issued:
        """Issue a certificate for `name` in `role`; a previous one is revoked.

        It ends with the authority at the latest, as no link is made with it after that.

        Args:
            name: such as "daq" or "ann".
            role: one of `ROLES`.
            addresses: further names or addresses of the router's machine.

        Raises:
            KeysError: the role is unknown, the name is none, the authority has ended, or the folder
                cannot be written.
        """
        if role not in ROLES:
            raise KeysError(f"role: found {role!r}, expected one of {', '.join(ROLES)}")
        _check_name("name", name)
        with self._alone():
            return self._issued(name, role, addresses)

    def _issued(self, name: str, role: str, addresses: Iterable[str]) -> Issued:
        serial = 1 + max((one.serial for one in self.register.issued), default=0)
        ends = self._end()
        issued = Issued(name, role, serial, ends.strftime("%Y-%m-%d"))
        key = ec.generate_private_key(ec.SECP256R1())
        builder = _builder(_name(issued.common_name), self._certificate.subject, key, ends)
        builder = builder.add_extension(_alternative_names(role, addresses), critical=False)
        usage = x509.ExtendedKeyUsage(
            [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
        )
        certificate = builder.add_extension(usage, critical=False).sign(self._key, hashes.SHA256())
        public, private = key_files(self.folder, name)
        _write(self.folder, private.name, _private(key), secret=True)
        _write(self.folder, public.name, _pem(certificate))
        self._save((*self._without(name), issued))
        return issued

    def _end(self) -> datetime:
        """When a certificate that is issued now ends."""
        now, last = datetime.now(UTC), self._certificate.not_valid_after_utc
        if now > last:
            renewed = "make a new one with `rigwatch keys new` and issue all certificates anew"
            raise KeysError(f"{self.folder}: the authority has ended on {last:%Y-%m-%d}: {renewed}")
        return min(now + timedelta(days=CERTIFICATE_DAYS), last)

    def revoke(self, name: str) -> Issued:
        """Revoke the certificate of `name`.

        Raises:
            KeysError: there is no valid one.
        """
        with self._alone():
            found = [one for one in self.register.issued if one.name == name and not one.revoked]
            if not found:
                raise KeysError(f"{name}: has no valid certificate in {self.folder}")
            self._save(self._without(name))
        return found[-1]

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Change the register as it is now, while no other process does: no revocation is lost."""
        folder = os.open(self.folder, os.O_RDONLY)
        try:
            with suppress(OSError):  # a file system without locks
                fcntl.flock(folder, fcntl.LOCK_EX)
            self.register = read_register(self.folder)
            yield
        finally:
            os.close(folder)

    def _without(self, name: str) -> tuple[Issued, ...]:
        return tuple(
            msgspec.structs.replace(one, revoked=True) if one.name == name else one
            for one in self.register.issued
        )

    def _save(self, issued: tuple[Issued, ...]) -> None:
        self.register = Register(self.register.rig, issued)
        _write(self.folder, REGISTER, msgspec.json.encode(self.register))


def _check_name(what: str, name: str) -> None:
    if not _NAME.fullmatch(name):
        expected = f"1 to {LONGEST_NAME} ASCII letters, digits, - and _"
        raise KeysError(f"{what}: found {name!r}, expected {expected}")


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, ends: datetime
) -> x509.CertificateBuilder:
    now = datetime.now(UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(hours=1))
        .not_valid_after(ends)
    )


def _alternative_names(role: str, addresses: Iterable[str]) -> x509.SubjectAlternativeName:
    local = ("localhost", "127.0.0.1", "::1", socket.gethostname()) if role == "router" else ()
    found: list[x509.GeneralName] = []
    for address in (*local, *addresses) or (role,):
        try:
            found.append(x509.IPAddress(ipaddress.ip_address(address)))
        except ValueError:
            found.append(x509.DNSName(address))
    return x509.SubjectAlternativeName(found)


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)


def _private(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def _write(folder: Path, name: str, data: bytes, *, secret: bool = False) -> None:
    """Write a file atomically; a private key is never readable by others."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        replace_file(folder / name, data, mode=0o600 if secret else 0o644)
    except OSError as error:
        raise KeysError(f"{folder / name}: cannot be written: {reason_of(error)}") from error

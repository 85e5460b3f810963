"""Verifies that a command comes from the operator it names."""

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.wire.access.register import Issued, authority_file, read_register
from rigwatch.wire.access.replays import CommandRun
from rigwatch.wire.access.statement import Proof, read_proof, statement
from rigwatch.wire.errors import KeysError, reason_of

if TYPE_CHECKING:
    from cryptography import x509

OPERATOR = "operator"


class Verifier:
    """Verifies the commands that one process receives in one run.

    The register is read for each command, so that a revocation is in force at once.

    Args:
        folder: of the keys, with `authority.pem` and `register.json`.
        rig: id of the rig.

    Attributes:
        run: random identity of this run; a command must name it.
        proves_user: the name in a command is that of the certificate.
    """

    proves_user = True

    def __init__(self, folder: Path, rig: str) -> None:
        self._folder, self._rig = folder, rig
        self._commands = CommandRun()
        self.run = self._commands.run

    def check(self, user: str, text: str, said: tuple[str, ...]) -> None:
        """Verify a command.

        Args:
            user: the user that it names.
            text: its proof.
            said: its fields, its kind first.

        Raises:
            KeysError: why it is refused.
        """
        proof = read_proof(text)
        certificate = _certificate(proof)
        self._check_issuer(certificate)
        issued = self._issued(certificate)
        if issued.name != user:
            raise KeysError(f"it is signed by {issued.name}, expected {user}")
        _check_signature(certificate, proof, statement(self._rig, proof, said))
        self._commands.check(proof, issued.common_name)

    def _check_issuer(self, certificate: "x509.Certificate") -> None:
        from cryptography import x509
        from cryptography.exceptions import InvalidSignature

        path = authority_file(self._folder)
        try:
            authority = x509.load_pem_x509_certificate(path.read_bytes())
        except (OSError, ValueError) as error:
            raise KeysError(f"{path}: cannot be read: {reason_of(error)}") from None
        try:
            certificate.verify_directly_issued_by(authority)
        except (InvalidSignature, ValueError, TypeError):
            raise KeysError("its certificate is of another authority") from None

    def _issued(self, certificate: "x509.Certificate") -> Issued:
        """The register's entry of a certificate that is in force."""
        from cryptography.x509.oid import NameOID

        names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
        found = read_register(self._folder).find(str(names[0].value)) if names else None
        if found is None:
            raise KeysError("its certificate is not in the register")
        if found.revoked:
            raise KeysError(f"the certificate of {found.name} is revoked")
        now = datetime.now(UTC)
        if not certificate.not_valid_before_utc <= now <= certificate.not_valid_after_utc:
            raise KeysError(f"the certificate of {found.name} is valid until {found.ends}")
        if found.role != OPERATOR:
            raise KeysError(f"{found.name} has the role {found.role}, expected {OPERATOR}")
        return found


def _certificate(proof: Proof) -> "x509.Certificate":
    from cryptography import x509

    try:
        return x509.load_pem_x509_certificate(proof.certificate.encode())
    except ValueError:
        raise KeysError("its certificate cannot be read") from None


def _check_signature(certificate: "x509.Certificate", proof: Proof, signed: bytes) -> None:
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec

    key = certificate.public_key()
    try:
        if not isinstance(key, ec.EllipticCurvePublicKey):
            raise InvalidSignature
        key.verify(bytes.fromhex(proof.signature), signed, ec.ECDSA(hashes.SHA256()))
    except (InvalidSignature, ValueError):
        raise KeysError("its signature does not match its content") from None

"""Signs commands with an operator's private key."""

from dataclasses import dataclass
from pathlib import Path

from rigwatch.wire.access.register import key_files
from rigwatch.wire.access.statement import new_proof, statement
from rigwatch.wire.errors import KeysError, reason_of


@dataclass(frozen=True, slots=True)
class Signer:
    """The operator of a machine.

    Attributes:
        folder: of the keys.
        name: of the operator's certificate.
    """

    folder: Path
    name: str

    def sign(self, rig: str, runs: tuple[str, ...], said: tuple[str, ...]) -> str:
        """The proof of a command.

        Args:
            rig: id of the rig.
            runs: runs of the receivers.
            said: fields of the command, its kind first.

        Raises:
            KeysError: certificate or key cannot be read.
        """
        # Slow to import, and only operators sign.
        from cryptography.hazmat.primitives import hashes, serialization
        from cryptography.hazmat.primitives.asymmetric import ec

        public, private = key_files(self.folder, self.name)
        try:
            certificate = public.read_text(encoding="ascii")
            key = serialization.load_pem_private_key(private.read_bytes(), None)
        except (OSError, ValueError) as error:
            why = reason_of(error)
            raise KeysError(f"{private}: key of the operator cannot be read: {why}") from None
        if not isinstance(key, ec.EllipticCurvePrivateKey):
            raise KeysError(f"{private}: found a key of another kind, expected ECDSA P-256")
        proof = new_proof(certificate, runs)
        signature = key.sign(statement(rig, proof, said), ec.ECDSA(hashes.SHA256()))
        return proof.signed(signature.hex()).to_text()

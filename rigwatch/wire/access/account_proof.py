"""Commands on a rig without keys: proof that they come from the account that runs the rig.

HMAC with SHA-256 over the same statement that an operator with a certificate signs: rig, command,
runs of the receivers, nonce and time.
"""

import contextlib
import hashlib
import hmac

from rigwatch.wire.access.account_secret import own_secret, read_secret, secret_file
from rigwatch.wire.access.replays import CommandRun
from rigwatch.wire.access.statement import Proof, new_proof, read_proof, statement
from rigwatch.wire.errors import KeysError
from rigwatch.wire.rig_config import SecuritySection


class AccountSigner:
    """Signs commands with the secret of the account.

    Args:
        security: section [bus.security].
    """

    def __init__(self, security: SecuritySection) -> None:
        self._security = security

    def sign(self, rig: str, runs: tuple[str, ...], said: tuple[str, ...]) -> str:
        """The proof of a command; arguments as of `Signer.sign`.

        Raises:
            KeysError: the secret cannot be read.
        """
        secret = read_secret(secret_file(self._security))
        proof = new_proof("", runs)
        return proof.signed(_code(secret, rig, proof, said)).to_text()


class AccountVerifier:
    """Verifies the commands that one process receives in one run.

    A secret that cannot be made refuses all commands, and stops nothing else.

    Args:
        security: section [bus.security].
        rig: id of the rig.

    Attributes:
        run: random identity of this run; a command must name it.
        proves_user: the name in a command is what the sender wrote.
    """

    proves_user = False

    def __init__(self, security: SecuritySection, rig: str) -> None:
        self._security, self._rig = security, rig
        self._commands = CommandRun()
        self.run = self._commands.run
        with contextlib.suppress(KeysError):
            own_secret(secret_file(security))

    def check(self, user: str, text: str, said: tuple[str, ...]) -> None:  # noqa: ARG002
        """Verify a command; arguments as of `Verifier.check`.

        Raises:
            KeysError: why it is refused.
        """
        proof = read_proof(text)
        code = _code(own_secret(secret_file(self._security)), self._rig, proof, said)
        if not hmac.compare_digest(code.encode(), proof.signature.encode("utf-8", "replace")):
            raise KeysError("it is not signed with the secret of the account that runs the rig")
        self._commands.check(proof)


def _code(secret: bytes, rig: str, proof: Proof, said: tuple[str, ...]) -> str:
    return hmac.new(secret, statement(rig, proof, said), hashlib.sha256).hexdigest()

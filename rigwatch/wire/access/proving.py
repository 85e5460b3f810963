"""How commands are proved on a rig: by a person's certificate, or without keys by the account."""

from pathlib import Path
from typing import Protocol

from rigwatch.wire.access.account_proof import AccountSigner, AccountVerifier
from rigwatch.wire.access.signing import Signer
from rigwatch.wire.access.verifying import Verifier
from rigwatch.wire.rig_config import SecuritySection


class CommandSigner(Protocol):
    """Makes the proof of a command."""

    def sign(self, rig: str, runs: tuple[str, ...], said: tuple[str, ...]) -> str:
        """The proof; see `Signer.sign`."""


class CommandVerifier(Protocol):
    """Verifies the proofs of commands in one run of a process."""

    @property
    def run(self) -> str:
        """Identity of this run."""

    @property
    def proves_user(self) -> bool:
        """Whether the user's name is proved, not only the account."""

    def check(self, user: str, text: str, said: tuple[str, ...]) -> None:
        """Refuse a command by a KeysError; see `Verifier.check`."""


def signer_of(security: SecuritySection, name: str) -> CommandSigner:
    """The signer of a rig's commands; `name` is that of the certificate, if there are keys."""
    return Signer(Path(security.keys), name) if security.keys else AccountSigner(security)


def verifier_of(security: SecuritySection, rig: str) -> CommandVerifier:
    """The verifier of a rig's commands."""
    keys = security.keys
    return Verifier(Path(keys), rig) if keys else AccountVerifier(security, rig)

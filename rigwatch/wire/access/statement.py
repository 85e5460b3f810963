"""What is signed: the command, its rig, its receivers' runs, a nonce and the time.

    certificate ─┐
    signature ───┼─▶ Proof ─▶ text in the field `proof` of a command or model request
    runs, nonce ─┘

The signed bytes are the parts of the statement, each preceded by its length, so that no two
statements have the same bytes.
"""

import secrets
import time

import msgspec

from rigwatch.wire.errors import KeysError
from rigwatch.wire.typed_files import JsonError, json_value

VERSION = "rigwatch command 1"
LARGEST_PROOF = 1 << 13
"""Longest proof that is read; one with a certificate has about 1500 characters."""


class Proof(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The signature of a command and what is needed to verify it.

    Attributes:
        certificate: the operator's, PEM; "" on a rig without keys.
        runs: runs of the receivers that may execute the command.
        nonce: random, different for each command.
        t_ns: time of signing [ns].
        signature: ECDSA with SHA-256 over `statement`, without keys HMAC with SHA-256;
            hexadecimal.
    """

    certificate: str
    runs: tuple[str, ...]
    nonce: str
    t_ns: int
    signature: str = ""

    def signed(self, signature: str) -> "Proof":
        """The proof with its signature."""
        return msgspec.structs.replace(self, signature=signature)

    def to_text(self) -> str:
        """The proof as sent."""
        return msgspec.json.encode(self).decode()


def new_proof(certificate: str, runs: tuple[str, ...]) -> Proof:
    """A proof to be signed now."""
    return Proof(certificate, runs, secrets.token_hex(16), time.time_ns())


def statement(rig: str, proof: Proof, said: tuple[str, ...]) -> bytes:
    """The bytes that are signed.

    Args:
        rig: id of the rig.
        proof: runs, nonce and time are part of the statement.
        said: fields of the command, its kind first.
    """
    parts = (VERSION, rig, proof.nonce, str(proof.t_ns), str(len(proof.runs)), *proof.runs, *said)
    texts = [part.encode("utf-8", "surrogatepass") for part in parts]
    return b"".join(len(text).to_bytes(4, "big") + text for text in texts)


def read_proof(text: str) -> Proof:
    """The proof in a command.

    Raises:
        KeysError: it is missing, too long or malformed.
    """
    if not text:
        raise KeysError("it is not signed")
    if len(text) > LARGEST_PROOF:
        raise KeysError(f"its proof has {len(text)} characters, expected at most {LARGEST_PROOF}")
    try:
        return json_value(text.encode(), Proof)
    except (JsonError, UnicodeEncodeError):
        raise KeysError("its proof cannot be read") from None


def names_a_person(text: str) -> bool:
    """Whether a verified proof is that of a certificate, which names a person."""
    try:
        return bool(read_proof(text).certificate)
    except KeysError:
        return False

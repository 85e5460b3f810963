"""Which certificates end soon: one that has ended gets no new connection.

A link that stands outlives its certificates, so their end is noticed when the router or the machine
restarts. Certificate and key are read anew for each connection.
"""

from datetime import UTC, date, datetime
from pathlib import Path

from rigwatch.wire.access.register import Issued, Register, authority_file, key_files
from rigwatch.wire.errors import reason_of
from rigwatch.wire.rig_config import SecuritySection

SOON_DAYS = 30
"""Time before its end at which a certificate is due to be issued anew [days]."""


def days_left(issued: Issued, today: date) -> int:
    """Days until a certificate ends, negative afterwards; 0 if the register does not say when."""
    try:
        return (date.fromisoformat(issued.ends) - today).days
    except ValueError:
        return 0


def in_force(register: Register) -> list[Issued]:
    """The certificates that are not revoked."""
    return [one for one in register.issued if not one.revoked]


def ending_soon(register: Register, today: date) -> list[Issued]:
    """Those of them that have ended or will soon, the first to end first."""
    found = [one for one in in_force(register) if days_left(one, today) <= SOON_DAYS]
    return sorted(found, key=lambda one: days_left(one, today))


def ends_text(endings: list[Issued]) -> str:
    """Names and dates of certificates that end soon."""
    return ", ".join(f"{one.name} {one.ends}" for one in endings)


def endings_text(endings: list[Issued]) -> str:
    """A sentence on certificates that end soon."""
    return f"certificates end: {ends_text(endings)}; issue them anew with `rigwatch keys issue`"


def keys_trouble(security: SecuritySection, name: str) -> str:
    """Why no link can be had with the certificate of `name`: what is damaged, ended or not begun.

    Certificates of authority and router count too, as far as they are on this machine.

    Returns:
        a sentence; "" if nothing is wrong with them, or there are no keys.
    """
    if not security.keys:
        return ""
    folder = Path(security.keys)
    files = [authority_file(folder)]
    for one in dict.fromkeys(("router", name)):
        public, private = key_files(folder, one)
        # A machine has the files of the names that run on it.
        files += [public] * (public.is_file() or one == name)
        if one == name and (why := _key_trouble(public, private)):
            return why
    return "; ".join(filter(None, map(_trouble, files)))


def _trouble(path: Path) -> str:
    """Why a certificate is not accepted now."""
    # Slow to import, and needed where a link fails only.
    from cryptography import x509

    try:
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
    except OSError as error:
        return f"{path}: certificate cannot be read: {reason_of(error)}"
    except ValueError:
        return f"{path}: found no certificate in PEM, expected one"
    now, renewed = datetime.now(UTC), "issue it anew with `rigwatch keys issue`"
    begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    if now < begin:
        return f"{path} begins on {begin:%Y-%m-%d}: set this machine's clock"
    return f"{path} has ended on {end:%Y-%m-%d}: {renewed}" if now > end else ""


def _key_trouble(public: Path, private: Path) -> str:
    """Why a private key cannot be used with its certificate."""
    from cryptography import x509
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    try:
        key = load_pem_private_key(private.read_bytes(), None)
    except OSError as error:
        return f"{private}: key cannot be read: {reason_of(error)}"
    except (ValueError, TypeError):
        return f"{private}: found no private key in PEM without a password, expected one"
    try:
        certificate = x509.load_pem_x509_certificate(public.read_bytes())
    except (OSError, ValueError):
        return ""  # said of the certificate
    if certificate.public_key() != key.public_key():
        return f"{private}: found the key of another certificate, expected that of {public}"
    return ""

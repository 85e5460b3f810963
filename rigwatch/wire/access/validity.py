"""Which certificates end soon: one that has ended gets no new connection.

A link that stands outlives its certificates, so their end is noticed when the router or the machine
restarts. Certificate and key are read anew for each connection.
"""

from datetime import UTC, date, datetime
from pathlib import Path

from rigwatch.wire.access.register import Issued, Register, authority_file, key_files
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


def out_of_force(security: SecuritySection, name: str) -> str:
    """Why no link can be had with the certificate of `name`: what has ended or not yet begun.

    Certificates of authority and router count too, as far as they are on this machine.

    Returns:
        a sentence; "" if all are in force, cannot be read, or there are no keys.
    """
    if not security.keys:
        return ""
    # Slow to import, and needed where a link fails only.
    from cryptography import x509

    folder = Path(security.keys)
    remedies = {
        authority_file(folder): "make new keys with `rigwatch keys new`",
        key_files(folder, "router")[0]: "issue it anew with `rigwatch keys issue`",
        key_files(folder, name)[0]: "issue it anew with `rigwatch keys issue`",
    }
    found, now = [], datetime.now(UTC)
    for path, remedy in remedies.items():
        try:
            certificate = x509.load_pem_x509_certificate(path.read_bytes())
        except (OSError, ValueError):
            continue
        begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
        if now > end:
            found.append(f"{path} has ended on {end:%Y-%m-%d}: {remedy}")
        elif now < begin:
            found.append(f"{path} begins on {begin:%Y-%m-%d}: set this machine's clock")
    return "; ".join(found)

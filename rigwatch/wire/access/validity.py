"""Which certificates end soon: one that has ended gets no connection any more."""

from datetime import date

from rigwatch.wire.access.register import Issued, Register

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


def endings_text(endings: list[Issued]) -> str:
    """A sentence on certificates that end soon."""
    dates = ", ".join(f"{one.name} {one.ends}" for one in endings)
    return f"certificates end: {dates}; issue them anew with `rigwatch keys issue` and restart"

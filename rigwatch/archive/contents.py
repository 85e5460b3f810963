"""What an archive holds, and what its catalogue says about one session."""

from dataclasses import dataclass, field

from rigwatch.archive.catalogue import Row, load
from rigwatch.archive.query import ask
from rigwatch.archive.store import Store
from rigwatch.wire.errors import ArchiveError, nearest

_HIDDEN = ("stamp", "files", "going")


@dataclass(slots=True)
class Shown:
    """What is shown.

    Attributes:
        rigs: a row per rig.
        unsound: sessions that are not ok.
        session: the session asked for.
        alarms: its alarms.
        losses: its losses.
    """

    rigs: list[Row] = field(default_factory=list)
    unsound: list[Row] = field(default_factory=list)
    session: Row = field(default_factory=dict)
    alarms: list[Row] = field(default_factory=list)
    losses: list[Row] = field(default_factory=list)


def show(store: Store, session: str | None = None) -> Shown:
    """An archive by rig, or one of its sessions.

    Raises:
        ArchiveError: there is no index, or no such session.
    """
    if session is None:
        return Shown(ask(store, "rigs").as_dicts(), ask(store, "unsound").as_dicts())
    kept = load(store)
    if not kept.sessions:
        raise ArchiveError(f"{store.url}: has no index, make one with rigwatch archive index")
    if session not in kept.sessions:
        raise ArchiveError(f"{store.url}: no session {session!r}{nearest(session, kept.sessions)}")
    found = {name: value for name, value in kept.sessions[session].items() if name not in _HIDDEN}
    alarms, losses = (
        [row for row in r if row["session"] == session] for r in (kept.alarms, kept.losses)
    )
    return Shown(session=found, alarms=alarms, losses=losses)

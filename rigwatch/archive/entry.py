"""One entry of an archive, a session file or a folder of segments, as a row of the catalogue.

file(s) ─▶ one pass: summary, losses, alarms, figures per second ─▶ row, files of seconds
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import quote

from rigwatch.archive.layout import SECONDS
from rigwatch.archive.second_aggregates import SecondAggregates
from rigwatch.archive.store import Store, Stored
from rigwatch.archive.tables import write_seconds
from rigwatch.batch import content_hash
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import (
    PROBABLY_MISSING,
    EstimateBlock,
    Event,
    Gap,
    Message,
    transitions,
)
from rigwatch.wire.session import SUFFIX, Session, Summary, is_segment, open_session, summarise

OK, DAMAGED, UNFINISHED, UNREADABLE, DUPLICATE, THINNED = (
    "ok",
    "damaged",
    "unfinished",
    "unreadable",
    "duplicate",
    "thinned",
)


@dataclass(frozen=True, slots=True)
class Entry:
    """A session in the store: its name, and its files in order."""

    name: str
    files: tuple[Stored, ...]

    @property
    def size(self) -> int:
        """All bytes of it."""
        return sum(file.size for file in self.files)

    @property
    def stamp(self) -> str:
        """Changes when a file is added, removed or written."""
        said = "".join(f"{file}\n" for file in self.files)
        return hashlib.sha256(said.encode()).hexdigest()[:16]


def entries(files: list[Stored]) -> list[Entry]:
    """The sessions among the files of a store, in order of their names."""
    found: dict[str, list[Stored]] = {}
    for file in files:
        if file.name.endswith(SUFFIX):
            path = PurePosixPath(file.name)
            in_folder = is_segment(path) and len(path.parts) > 1
            name = str(path.parent) if in_folder else file.name
            found.setdefault(name, []).append(file)
    return [Entry(name, tuple(found[name])) for name in sorted(found)]


class _Seen:
    """What the catalogue wants from the messages besides their summary."""

    def __init__(self) -> None:
        self.seconds = SecondAggregates()
        self.gaps: list[Gap] = []
        self.probable: list[str] = []

    def __call__(self, message: Message) -> None:
        if isinstance(message, EstimateBlock):
            self.seconds.add(message)
        elif isinstance(message, Gap):
            self.gaps.append(message)
        elif isinstance(message, Event) and message.code == PROBABLY_MISSING:
            self.probable.append(message.text)


def catalogued(store: Store, entry: Entry) -> dict[str, Any]:
    """The row of an entry, with its alarms and losses; its figures per second are stored.

    An entry that cannot be read has a row that says so.
    """
    with store.local([file.name for file in entry.files]) as paths:
        path = paths[0] if len(paths) == 1 else paths[0].parent
        row = _bare(entry, _content(paths))
        try:
            return row | _read(store, open_session(path), row["content"])
        except SessionError as error:
            reason = str(error).removeprefix(f"{path}: ").replace(str(path), entry.name)
            return row | {"status": UNREADABLE, "remark": reason}


def _content(paths: list[Path]) -> str:
    hashes = [content_hash(path) for path in paths]
    whole = "".join(hashes).encode()
    return hashes[0] if len(hashes) == 1 else hashlib.sha256(whole).hexdigest()


def _bare(entry: Entry, content: str) -> dict[str, Any]:
    return {
        "session": entry.name,
        "content": content,
        "bytes": entry.size,
        "stamp": entry.stamp,
        "segments": len(entry.files),
    }


def _read(store: Store, session: Session, content: str) -> dict[str, Any]:
    seen = _Seen()
    summary = summarise(session, seen)
    rig = summary.run.rig if summary.run else ""
    return (
        _figures(summary, rig)
        | _condition(summary)
        | {
            "probably_missing": seen.probable,
            "files": stored_seconds(store, seen.seconds, rig, content[:16]),
            "alarm_rows": [_alarm_row(alarm) for alarm in transitions(summary.alarms)],
            "loss_rows": _loss_rows(summary, seen.gaps),
        }
    )


def _figures(summary: Summary, rig: str) -> dict[str, Any]:
    devices = summary.devices
    flags: dict[str, int] = {}
    for channel in (channel for device in devices for channel in device.channels):
        for name, count in channel.flags.items():
            flags[name] = flags.get(name, 0) + count
    judged = sum(flags.values())
    return {
        "rig": rig,
        "start_ns": summary.start_ns,
        "end_ns": summary.end_ns,
        "duration_s": summary.duration_s,
        "rate_hz": summary.run.sample_rate_hz if summary.run else None,
        "samples": sum(device.samples for device in devices),
        "missing": sum(device.missing for device in devices),
        "gaps": sum(device.gaps for device in devices),
        "restarts": sum(max(0, device.boots - 1) for device in devices),
        "good": flags.get("good", 0) / judged if judged else None,
        "estimates": summary.topics.get("estimates", 0) > 0,
        "raised": [
            alarm.name for alarm in transitions(summary.alarms) if alarm.state == "unacknowledged"
        ],
        "software": summary.run.software if summary.run else "",
        "configuration": summary.run.configuration_sha256 if summary.run else "",
        "notes": summary.run.notes if summary.run else "",
    }


def _condition(summary: Summary) -> dict[str, Any]:
    """Status and remark: how whole the session is, in one sentence."""
    lost = sum(span.size for span in summary.lost)
    if lost:
        reason = summary.lost[0].reason
        parts = f"{len(summary.lost)} part(s) of {lost} bytes are damaged, the first: {reason}"
        return {"status": DAMAGED, "remark": parts, "damaged_bytes": lost}
    if summary.unclosed:
        remark = f"{summary.unclosed[-1]} is not closed: still being recorded, or cut off"
        return {"status": UNFINISHED, "remark": remark, "damaged_bytes": 0}
    return {"status": OK, "remark": "", "damaged_bytes": 0}


def _alarm_row(alarm: Any) -> dict[str, Any]:
    names = ("t_ns", "name", "state", "severity", "cause", "value", "low", "high", "user")
    return {name: getattr(alarm, name) for name in names}


def _loss_rows(summary: Summary, gaps: list[Gap]) -> list[dict[str, Any]]:
    """Losses with their times: reported gaps, and damaged parts."""
    reported = [
        _loss(gap.topic or "samples", gap.t_ns, max(0, gap.last - gap.first + 1), gap.reason)
        for gap in gaps
    ]
    damaged = [
        _loss("bytes", span.after_ns or summary.start_ns, span.size, span.reason)
        for span in summary.lost
    ]
    return reported + damaged


def _loss(what: str, t_ns: int, count: int, reason: str) -> dict[str, Any]:
    return {"what": what, "t_ns": t_ns, "count": count, "reason": reason}


def stored_seconds(store: Store, seconds: SecondAggregates, rig: str, part: str) -> list[str]:
    """Store the figures of each day, each in a file `part`; names of the files."""
    names = []
    with TemporaryDirectory(prefix="rigwatch-") as folder:
        for day, table in seconds.days():
            name = f"{SECONDS}/rig={quote(rig, safe='') or 'unknown'}/day={day}/{part}.parquet"
            write_seconds(Path(folder, "part"), table)
            store.put(Path(folder, "part"), name)
            names.append(name)
    return names

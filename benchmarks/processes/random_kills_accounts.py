"""What is missing after the random kills, without a report in its place.

samples     every one that anybody heard, and every number between two others of its boot
estimates   one for each recorded sample
alarms      every change of state in the journal, and every one that anybody heard

A gap of known length covers its numbers. One of unknown length, as after a kill of the monitor,
which takes its ring with it, covers what is missing in its place: estimates between the one before
it and the one after it, alarms between the one before it and its own report.
"""

from dataclasses import dataclass
from pathlib import Path

from benchmarks.processes.random_kills_places import (
    Said,
    Span,
    changes_of,
    estimate_holes,
    in_open_end,
    key_of,
    silent_changes,
    spans_without,
)
from monitor.alarms import AlarmRecord, read_journal
from rigwatch.wire.messages import MONITOR_STALE, Alarm, EstimateBlock, Event, Gap, SampleBlock
from rigwatch.wire.session import open_session

ON_THE_WAY_NS = 2_000_000_000
"""Time before a listener's end in which a change may still be on its way to it [ns]."""
END_OF_RUN = 512
"""Samples at the end whose estimates need not be recorded, as processes end one by one."""
TOPICS = ("samples", "estimates", "alarms", "gaps", "events")
JOURNAL, SESSIONS, HEARD = "alarms.jsonl", "sessions", "listener-*.mcap"


@dataclass(frozen=True)
class Account:
    """How much of one kind of message there was, and what is missing without a report."""

    what: str
    total: int
    missing: int
    note: str


@dataclass
class Recording:
    """The messages of one reader, in order.

    Attributes:
        began_ns, ended_ns: Unix time of its start, and of its end if it reports one [ns].
    """

    began_ns: int
    ended_ns: int
    samples: list[tuple[int, Span] | Gap]
    estimates: list[tuple[int, Span] | Gap]
    alarms: list[Said]
    lost_by_monitor: list[Gap]


def accounts_of(folder: Path) -> list[Account]:
    """All accounts of a rig's folder: what listeners heard, and what was recorded."""
    listeners = {path.stem: read_recording([path], path.stem) for path in folder.glob(HEARD)}
    recorded = read_recording(sorted((folder / SESSIONS).glob("*Z*")), "recorder")
    recorded.ended_ns = min(one.ended_ns for one in listeners.values())
    readers = dict(sorted(listeners.items())) | {"the recording": recorded}
    records = read_journal(folder / JOURNAL)[0]
    journal = changes_of(records)
    stale = _heard_by_anybody([*readers.values()])
    accounts = [
        _samples(recorded, list(listeners.values())),
        _estimates(recorded),
        _journal(records, readers),
    ]
    for name, reader in readers.items():
        accounts.append(_alarms(f"alarms, {name}", journal, reader, "monitor"))
        accounts.append(_alarms(f"alarms of the witness, {name}", stale, reader, "witness"))
    return accounts


def _samples(found: Recording, witnesses: list[Recording]) -> Account:
    gaps = [one for one in found.samples if isinstance(one, Gap)]
    kept = [one for one in found.samples if not isinstance(one, Gap)]
    told = [(one.boot, (one.first, one.last)) for one in gaps if one.last >= one.first]
    ends: dict[int, int] = {}
    for boot, (_, last) in kept:
        ends[boot] = max(last, ends.get(boot, -1))
    heard = [one for w in witnesses for one in w.samples if not isinstance(one, Gap)]
    # The recorder joins the first boot; of the others it should have all.
    joined = {kept[0][0]: kept[0][1][0]}
    wanted = [(boot, (joined.get(boot, 0), last)) for boot, last in ends.items()]
    wanted += [one for one in heard if one[1][0] >= joined.get(one[0], 0)]
    open_ends = {one.boot for one in gaps if one.last < one.first}
    missing = [*spans_without(wanted, [*kept, *told])]
    silent = [one for one in missing if not in_open_end(*one, ends, open_ends, heard)]
    unseen = len({boot for boot, _ in heard} - set(ends))
    note = f"{_count(told)} reported lost; {len(ends)} boots, {len(open_ends)} with an open end, "
    note += f"{unseen} others within these ends; silent: {silent[:3]}"
    return Account("samples in the recording", _count(kept), _count(silent), note)


def _count(blocks: list[tuple[int, Span]]) -> int:
    return sum(last - first + 1 for _, (first, last) in blocks)


def _estimates(found: Recording) -> Account:
    missing, told = estimate_holes(found.samples, found.estimates, found.lost_by_monitor)
    last_boot, end = _end(found.samples)
    silent = [(boot, span) for boot, span in missing if boot != last_boot or span[0] < end]
    total = sum(one[1][1] - one[1][0] + 1 for one in found.estimates if not isinstance(one, Gap))
    note = f"{told} in a reported gap; silent: {len(silent)} holes {silent[:3]}"
    count = sum(last - first + 1 for _, (first, last) in silent)
    return Account("estimates in the recording", total, count, note)


def _end(samples: list[tuple[int, Span] | Gap]) -> tuple[int, int]:
    """The last boot, and the number from which its estimates may still be on their way."""
    boot, (_, last) = next(one for one in reversed(samples) if not isinstance(one, Gap))
    return boot, last - END_OF_RUN


def _journal(records: list[AlarmRecord], readers: dict[str, Recording]) -> Account:
    """Alarms are journalled before they are published: whether any was only heard."""
    known = {key_of(record.alarm) for record in records}
    heard = {
        key_of(alarm): alarm
        for reader in readers.values()
        for alarm in reader.alarms
        if isinstance(alarm, Alarm) and alarm.name != MONITOR_STALE
    }
    silent = [alarm for key, alarm in heard.items() if key not in known]
    return Account("alarms in the journal", len(heard), len(silent), _examples(silent))


def _heard_by_anybody(readers: list[Recording]) -> list[Alarm]:
    """The changes of the witness's alarm, which keeps no journal, in order."""
    heard = {
        key_of(alarm): alarm
        for reader in readers
        for alarm in reader.alarms
        if isinstance(alarm, Alarm) and alarm.name == MONITOR_STALE
    }
    return sorted(heard.values(), key=lambda alarm: alarm.t_ns)


def _alarms(what: str, changes: list[Alarm], reader: Recording, sender: str) -> Account:
    due = [one for one in changes if reader.began_ns <= one.t_ns < reader.ended_ns - ON_THE_WAY_NS]
    said = [one for one in reader.alarms if _sender(one) == sender]
    silent, told = silent_changes(changes, due, said)
    gaps = sum(isinstance(one, Gap) for one in said)
    note = f"{len(due)} changes of state, {told} of them in one of {gaps} reported gaps"
    return Account(what, len(due), len(silent), note + _examples(silent))


def _sender(said: Said) -> str:
    if isinstance(said, Gap):
        return said.device
    return "witness" if said.name == MONITOR_STALE else "monitor"


def _examples(missing: list[Alarm]) -> str:
    return "".join(f"; {one.name} {one.state} at {one.t_ns}" for one in missing[:3])


def read_recording(sessions: list[Path], reader: str) -> Recording:
    """All sessions of one reader, one after the other."""
    found = Recording(0, 0, [], [], [], [])
    for path in sessions:
        session = open_session(path)
        found.began_ns = found.began_ns or session.info.t_ns
        for recorded in session.messages(list(TOPICS)):
            _take(found, recorded.message, reader)
    return found


def _take(found: Recording, item: object, reader: str) -> None:
    if isinstance(item, SampleBlock | EstimateBlock):
        kind = found.samples if isinstance(item, SampleBlock) else found.estimates
        kind.append((item.boot, (item.seq, item.seq + len(item) - 1)))
    elif isinstance(item, Alarm):
        found.alarms.append(item)
    elif isinstance(item, Gap):
        _take_gap(found, item, reader)
    elif isinstance(item, Event) and item.source == reader:
        found.ended_ns = item.t_ns


def _take_gap(found: Recording, gap: Gap, reader: str) -> None:
    if (gap.reporter, gap.topic, gap.device) == (reader, "estimates", "monitor"):
        found.estimates.append(gap)
    elif gap.reporter == reader and gap.topic == "alarms":
        found.alarms.append(gap)
    elif gap.reporter == reader and not gap.topic:
        found.samples.append(gap)
    elif gap.reporter == "monitor" and not gap.topic:
        found.lost_by_monitor.append(gap)

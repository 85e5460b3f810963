"""What is missing after the random kills, without a report, in the recording and for listeners.

samples     numbers between the first and the last of a boot: recorded, or in a gap
estimates   one for each recorded sample between the first and the last estimate of a boot,
            unless a gap of samples or of estimates was reported
alarms      every change of state in the journal, and every one that anybody heard: heard, or
            told anew by the monitor's next run, or a gap of alarms was reported within a minute

A killed monitor takes its ring with it, so the length of such a gap is unknown.
"""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from benchmarks.processes.losses import faults
from monitor.alarms import AlarmRecord, read_journal
from rigwatch.wire.messages import Alarm, EstimateBlock, Gap, SampleBlock
from rigwatch.wire.session import open_session

Span = tuple[int, int]
NEAR_NS = 60_000_000_000
"""Largest time between a change that is missing and the report of its gap [ns]."""
ON_THE_WAY_NS = 2_000_000_000
"""Time before a listener's end in which a change may still be on its way to it [ns]."""
TOPICS = ("samples", "estimates", "alarms", "gaps")


@dataclass(frozen=True)
class Account:
    """How much of one kind of message there was, and what is missing without a report."""

    what: str
    total: int
    missing: int
    note: str


@dataclass
class Recording:
    """The messages of all sessions, in order."""

    samples: dict[int, list[Span]]
    estimates: dict[int, list[Span]]
    alarms: list[Alarm]
    gaps: list[Gap]


def heard_account(
    name: str, heard: list[Alarm], gaps: list[Gap], journal: Path, ended_ns: int
) -> Account:
    """Whether a listener has heard all alarms of the journal, up to shortly before its end."""
    wanted = changes_of(read_journal(journal)[0])
    due = [alarm for alarm in wanted if alarm.t_ns < ended_ns - ON_THE_WAY_NS]
    return _alarm_account(f"alarms, {name}", due, heard, gaps)


def _alarm_account(what: str, wanted: list[Alarm], heard: list[Alarm], gaps: list[Gap]) -> Account:
    missing = unheard(wanted, heard)
    silent = [one for one in missing if not any(abs(g.t_ns - one.t_ns) < NEAR_NS for g in gaps)]
    note = (
        f"{len(wanted)} changes of state, {len(heard)} messages; {len(missing)} changes in one of "
        f"{len(gaps)} reported gaps"
    )
    return Account(what, len(wanted), len(silent), note + _examples(silent))


def recorded_account(folder: Path, journal: Path, heard: list[list[Alarm]]) -> list[Account]:
    """What the recording lacks."""
    found = read_recording(folder)
    return [_samples(found), _estimates(found), _alarms(found, journal, heard)]


def _samples(found: Recording) -> Account:
    lost: dict[int, list[Span]] = {}
    for gap in found.gaps:
        if not gap.topic and gap.reporter == "recorder" and gap.last >= gap.first:
            lost.setdefault(gap.boot, []).append((gap.first, gap.last))
    missing = total = gone = 0
    for boot, spans in found.samples.items():
        told = [(first, last, True) for first, last in lost.get(boot, [])]
        here = [(first, last, False) for first, last in spans]
        missing += faults(here + told)[0]
        total += sum(last - first + 1 for first, last in spans)
        gone += sum(last - first + 1 for first, last, _ in told)
    return Account(
        "samples in the recording", total, missing, f"{total} kept, {gone} reported lost"
    )


def _estimates(found: Recording) -> Account:
    excused: dict[int, list[Span]] = {}
    messages = 0
    for gap in found.gaps:
        if gap.topic == "estimates":
            messages += max(1, gap.last - gap.first + 1)
        elif not gap.topic and gap.last >= gap.first:
            excused.setdefault(gap.boot, []).append((gap.first, gap.last))
    missing = total = 0
    holes: list[Span] = []
    for boot, spans in found.estimates.items():
        told = [(first, last, True) for first, last in excused.get(boot, [])]
        covered = sorted([*((a, b, False) for a, b in spans), *told])
        holes += _holes(covered, min(spans)[0], max(last for _, last in spans))
        total += sum(last - first + 1 for first, last in spans)
    unexcused = holes if len(holes) > messages else []
    missing = sum(last - first + 1 for first, last in unexcused)
    note = f"{total} kept, {len(holes)} holes, {messages} messages reported lost {holes[:3]}"
    return Account("estimates in the recording", total, missing, note)


def _holes(covered: list[tuple[int, int, bool]], first: int, last: int) -> list[Span]:
    found, following = [], first
    for begin, end, _ in covered:
        if begin > following and following <= last:
            found.append((following, min(begin - 1, last)))
        following = max(following, end + 1)
    return found


def _alarms(found: Recording, journal: Path, heard: list[list[Alarm]]) -> Account:
    wanted = changes_of(read_journal(journal)[0])
    known = {_key(alarm) for alarm in wanted}
    for alarm in (one for who in heard for one in who):
        if _key(alarm) not in known:
            known.add(_key(alarm))
            wanted.append(alarm)
    gaps = [gap for gap in found.gaps if gap.topic == "alarms" and gap.reporter == "recorder"]
    return _alarm_account("alarms in the recording", wanted, found.alarms, gaps)


def changes_of(records: list[AlarmRecord]) -> list[Alarm]:
    """The changes of state that are announced: not those that a flood groups."""
    states: dict[str, str] = {}
    found = []
    for record in records:
        alarm = record.alarm
        if states.get(alarm.name, "normal") != alarm.state and not record.grouped:
            found.append(alarm)
        states[alarm.name] = alarm.state
    return found


def unheard(wanted: list[Alarm], heard: list[Alarm]) -> list[Alarm]:
    """Alarms that were not heard, and whose state was not said anew before it changed again."""
    keys = {_key(alarm) for alarm in heard}
    by_name: dict[str, list[Alarm]] = {}
    for alarm in heard:
        by_name.setdefault(alarm.name, []).append(alarm)
    return [
        alarm
        for alarm in wanted
        if _key(alarm) not in keys and not _told_anew(alarm, by_name.get(alarm.name, []))
    ]


def _told_anew(alarm: Alarm, heard: list[Alarm]) -> bool:
    """Whether the state that follows in what was heard is that of `alarm`."""
    return any(
        before.t_ns <= alarm.t_ns <= after.t_ns and after.state == alarm.state
        for before, after in pairwise(heard)
    )


def _key(alarm: Alarm) -> tuple[str, str, int]:
    return alarm.name, alarm.state, alarm.t_ns


def _examples(missing: list[Alarm]) -> str:
    return "".join(f"; {one.name} {one.state} at {one.t_ns}" for one in missing[:3])


def read_recording(folder: Path) -> Recording:
    """All sessions of a folder, one after the other."""
    found = Recording({}, {}, [], [])
    for session in sorted(folder.iterdir()):
        for recorded in open_session(session).messages(list(TOPICS)):
            item = recorded.message
            if isinstance(item, SampleBlock | EstimateBlock):
                kind = found.samples if isinstance(item, SampleBlock) else found.estimates
                kind.setdefault(item.boot, []).append((item.seq, item.seq + len(item) - 1))
            elif isinstance(item, Gap):
                found.gaps.append(item)
            elif isinstance(item, Alarm):
                found.alarms.append(item)
    return found

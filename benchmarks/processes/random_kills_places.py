"""Whether what a reader lacks lies where it reports a gap."""

from bisect import bisect_left
from collections.abc import Iterator, Sequence

from monitor.alarms import AlarmRecord
from rigwatch.wire.messages import Alarm, Gap

Span = tuple[int, int]
Said = Alarm | Gap
Block = tuple[int, Span]
Place = tuple[int, int]


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


def key_of(alarm: Alarm) -> tuple[str, str, int]:
    """What distinguishes a change of state from all others."""
    return alarm.name, alarm.state, alarm.t_ns


def silent_changes(
    changes: Sequence[Alarm], due: Sequence[Alarm], said: Sequence[Said]
) -> tuple[list[Alarm], int]:
    """The changes that a reader neither heard nor was told of, and how many lie in its gaps.

    Args:
        changes: all changes of one sender, in order.
        due: those that the reader should have.
        said: messages and gaps of that sender, in the reader's order.
    """
    heard = _first_heard(changes, said)
    wanted = {id(one) for one in due}
    silent, told = [], 0
    for number, change in enumerate(changes):
        if id(change) not in wanted or number in heard or _said_anew(number, changes, said):
            continue
        if _in_a_gap(number, change, heard, said):
            told += 1
        else:
            silent.append(change)
    return silent, told


def _in_a_gap(number: int, change: Alarm, heard: dict[int, int], said: Sequence[Said]) -> bool:
    """Whether a change came after all that was heard before a gap, and before the gap's report.

    What follows a gap does not bound it: the sender's next run repeats standing alarms first. No
    margin is needed: the time of a change is not later than its message, which was lost before the
    report, and all clocks are this machine's.
    """
    newest = -1
    by_place = {place: one for one, place in heard.items()}
    for place, one in enumerate(said):
        newest = max(newest, by_place.get(place, -1))
        if isinstance(one, Gap) and newest < number and change.t_ns <= one.t_ns:
            return True
    return False


def _first_heard(changes: Sequence[Alarm], said: Sequence[Said]) -> dict[int, int]:
    """Where each change was heard first, by its number."""
    numbers = {key_of(one): number for number, one in enumerate(changes)}
    heard: dict[int, int] = {}
    for place, one in enumerate(said):
        if isinstance(one, Alarm):
            number = numbers.get(key_of(one))
            if number is not None:
                heard.setdefault(number, place)
    return heard


def _said_anew(number: int, changes: Sequence[Alarm], said: Sequence[Said]) -> bool:
    """Whether the same state was told of another sample, before it changed again."""
    change = changes[number]
    later = (one.t_ns for one in changes[number + 1 :] if one.name == change.name)
    until = next(later, 1 << 62)
    return any(
        isinstance(one, Alarm)
        and (one.name, one.state) == (change.name, change.state)
        and change.t_ns <= one.t_ns < until
        for one in said
    )


def estimate_holes(
    samples: Sequence[Block | Gap], estimates: Sequence[Block | Gap], lost: Sequence[Gap]
) -> tuple[list[Block], int]:
    """Recorded samples without an estimate and without a report, and how many samples have one.

    Args:
        samples: blocks of the recording, in order.
        estimates: the same, with gaps of estimates.
        lost: gaps of samples that the monitor reported.
    """
    order = {boot: rank for rank, boot in enumerate(dict.fromkeys(b for b, _ in _blocks(samples)))}
    has = [*_blocks(estimates), *((one.boot, (one.first, one.last)) for one in lost)]
    silent: list[Block] = []
    told = 0
    for boot, (first, last) in spans_without(list(_blocks(samples)), has):
        if _gap_at(estimates, order, (order[boot], first), (order[boot], last)):
            told += last - first + 1
        else:
            silent.append((boot, (first, last)))
    return silent, told


def _blocks(items: Sequence[Block | Gap]) -> Iterator[Block]:
    return (one for one in items if not isinstance(one, Gap))


def spans_without(wanted: list[Block], has: list[Block]) -> Iterator[Block]:
    """The parts of `wanted` that `has` lacks, boot by boot and in order."""
    for boot in dict.fromkeys(boot for boot, _ in wanted):
        there = _joined([span for one, span in has if one == boot])
        starts = [first for first, _ in there]
        for first, last in _joined([span for one, span in wanted if one == boot]):
            at = max(0, bisect_left(starts, first) - 1)
            following = first
            for begin, end in there[at:]:
                if begin > last:
                    break
                if begin > following:
                    yield boot, (following, begin - 1)
                following = max(following, end + 1)
            if following <= last:
                yield boot, (following, last)


def in_open_end(
    boot: int, span: Span, ends: dict[int, int], opened: set[int], heard: Sequence[Block]
) -> bool:
    """Whether missing samples lie where an end of unknown length is reported.

    That of a boot lasts until the next one that was recorded.

    Args:
        boot, span: the missing samples.
        ends: newest recorded sample of each boot.
        opened: boots whose end is reported as a gap of unknown length.
        heard: what was sent, in order.
    """
    if boot in ends:
        return boot in opened and span[0] > ends[boot]
    order = list(dict.fromkeys(one for one, _ in heard))
    before = [one for one in order[: order.index(boot)] if one in ends]
    return bool(before) and before[-1] in opened


def _joined(spans: list[Span]) -> list[Span]:
    """The same numbers in as few spans as possible, in order."""
    found: list[Span] = []
    for first, last in sorted(span for span in spans if span[1] >= span[0]):
        if found and first <= found[-1][1] + 1:
            found[-1] = found[-1][0], max(found[-1][1], last)
        else:
            found.append((first, last))
    return found


def _gap_at(
    estimates: Sequence[Block | Gap], order: dict[int, int], first: Place, last: Place
) -> bool:
    """Whether a gap is reported between the estimates before `first` and those after `last`."""
    before, after = -1, len(estimates)
    for place, one in enumerate(estimates):
        if isinstance(one, Gap) or one[0] not in order:
            continue
        rank = order[one[0]]
        if (rank, one[1][1]) < first:
            before = place
        elif (rank, one[1][0]) > last:
            after = min(after, place)
    return any(isinstance(one, Gap) for one in estimates[before + 1 : after])

"""Judges the demonstration: fault named, recording complete."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from rigwatch.wire.messages import Alarm
from rigwatch.wire.session import open_session

ALARM = "dry_friction"
WORDS = "dry friction"


@dataclass(frozen=True, slots=True)
class Recording:
    """The run's content in a session file.

    Attributes:
        path: the session.
        first, end: number of the first sample, and one past the last.
        samples: number of the rig's samples in it.
        estimates: number of samples with estimates.
        alarms: names of the raised alarms.
        faults: descriptions of its defects.
    """

    path: Path
    first: int
    end: int
    samples: int
    estimates: int
    alarms: tuple[str, ...]
    faults: tuple[str, ...]


def read_recording(path: Path) -> Recording:
    """Read the whole session and check it for missing samples.

    Raises:
        SessionError: it cannot be read.
    """
    session = open_session(path)
    blocks = [(block.boot, block.seq, len(block)) for block in session.samples()]
    estimates = sum(len(block) for block in session.estimates())
    raised = (r.message for r in session.messages(["alarms"]))
    alarms = tuple(m.name for m in raised if isinstance(m, Alarm) and m.state == "unacknowledged")
    faults = [f"damaged: {span.reason}" for span in session.lost]
    faults += ["not closed"] if session.unclosed else []
    faults += list(_missing(blocks))
    first, end = (blocks[0][1], blocks[-1][1] + blocks[-1][2]) if blocks else (0, 0)
    count = sum(n for _, _, n in blocks)
    return Recording(path, first, end, count, estimates, alarms, tuple(faults))


def _missing(blocks: Sequence[tuple[int, int, int]]) -> Iterator[str]:
    if not blocks:
        yield "holds no samples"
        return
    for (boot, seq, n), (next_boot, next_seq, _) in pairwise(blocks):
        if next_boot != boot:
            yield f"the device started again after sample {seq + n - 1}"
        elif next_seq != seq + n:
            yield f"samples {seq + n} to {next_seq - 1} are missing"


def complaints(
    alarms: Sequence[Alarm],
    recording: Recording,
    seen: range,
    *,
    exit_code: int = 0,
    fault_begun: bool = True,
) -> list[str]:
    """Why the demonstration failed; empty if it succeeded.

    Args:
        alarms: alarms raised during the run.
        recording: the recording.
        seen: sample numbers received by another reader of the bus.
        exit_code: of `rigwatch up`.
        fault_begun: whether the first fault had begun before the end.
    """
    found = list(recording.faults)
    if exit_code:
        found.append(f"rigwatch up ended with code {exit_code}")
    if seen and not (recording.first <= seen.start and seen.stop <= recording.end):
        has, saw = f"{recording.first} to {recording.end - 1}", f"{seen.start} to {seen.stop - 1}"
        found.append(f"samples {has} are in it, but {saw} were on the bus")
    found += list(_of_alarms(alarms, recording)) if fault_begun else ["it ended before a fault"]
    if recording.estimates == 0:
        found.append("no estimates are in the recording")
    return found


def _of_alarms(alarms: Sequence[Alarm], recording: Recording) -> Iterator[str]:
    named = [alarm for alarm in alarms if alarm.name == ALARM]
    if not named:
        others = ", ".join(alarm.name for alarm in alarms) or "none at all"
        yield f"no alarm named dry friction; alarms: {others}"
    elif WORDS not in named[0].cause.lower():
        yield f"the alarm does not say dry friction: {named[0].cause}"
    if ALARM not in recording.alarms:
        yield "the alarm is not in the recording"

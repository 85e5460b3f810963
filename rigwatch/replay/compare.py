"""Compares what the monitor publishes with a reference: which field, which sample, old → new.

differs where |new - old| > tolerance · max |old| over the recording
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from monitor.alarms import Announcement
from rigwatch.replay.reference import Output
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import Alarm, EstimateBlock

TOLERANCE = 1e-6
"""Tolerance of a field that no pattern names, relative to the field's largest value."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One field that differs.

    Attributes:
        field: column, condition or place in the list of announcements.
        sample: "boot:seq" of the first sample that differs, empty if none applies.
        t_ns: its time [ns].
        old, new: the values there, as text.
        further: number of later samples that differ.
    """

    field: str
    sample: str
    t_ns: int
    old: str
    new: str
    further: int = 0

    def __str__(self) -> str:
        where = f", sample {self.sample}" if self.sample else ""
        further = f" ({self.further} further samples differ)" if self.further else ""
        return f"{self.field}{where}: {self.old} → {self.new}{further}"


@dataclass(frozen=True, slots=True)
class Rules:
    """Defines what counts as a difference.

    Attributes:
        ignore: patterns of fields that are not compared.
        tolerance: tolerance by pattern of field; the first match counts.
    """

    ignore: Sequence[str] = ()
    tolerance: Mapping[str, float] | None = None

    def ignores(self, field: str) -> bool:
        """Whether the field is not compared."""
        return any(fnmatchcase(field, pattern) for pattern in self.ignore)

    def tolerance_of(self, field: str) -> float:
        """The field's tolerance, relative to its largest value."""
        fitting = (
            t for pattern, t in (self.tolerance or {}).items() if fnmatchcase(field, pattern)
        )
        return next(fitting, TOLERANCE)


def compare(old: Output, new: Output, rules: Rules) -> list[Difference]:
    """All differences, fields first, then announcements."""
    spans = [_span(block) for block in old.blocks], [_span(block) for block in new.blocks]
    if spans[0] != spans[1]:
        return [Difference("samples", "", 0, ", ".join(spans[0]), ", ".join(spans[1]))]
    found = [item for field in _fields(old, new) for item in _compare_field(field, old, new, rules)]
    return found + list(_compare_announcements(old, new, rules))


def _span(block: EstimateBlock) -> str:
    return f"{block.boot}:{block.seq} to {block.seq + len(block) - 1}"


def _fields(old: Output, new: Output) -> list[str]:
    """Names of all fields of both, in order."""
    blocks = (*old.blocks, *new.blocks)
    return list(dict.fromkeys(column.name for block in blocks for column in block.columns))


def _compare_field(field: str, old: Output, new: Output, rules: Rules) -> Iterator[Difference]:
    if rules.ignores(field):
        return
    before = [_values(block, field) for block in old.blocks]
    after = [_values(block, field) for block in new.blocks]
    if (before[0] is None) != (after[0] is None):
        was, now = ("published" if side[0] is not None else "absent" for side in (before, after))
        yield Difference(field, "", 0, was, now)
        return
    limit = rules.tolerance_of(field) * _largest(before)
    places = [_differing(a, b, limit) for a, b in zip(before, after, strict=True)]
    total = sum(map(len, places))
    if not total:
        return
    block, a, b, place = next(
        item for item in zip(old.blocks, before, after, places, strict=True) if len(item[3])
    )
    at = int(place[0])
    assert a is not None
    assert b is not None
    sample = f"{block.boot}:{block.seq + at}"
    yield Difference(field, sample, int(block.t_ns[at]), f"{a[at]:.9g}", f"{b[at]:.9g}", total - 1)


def _values(block: EstimateBlock, field: str) -> FloatArray | None:
    return next((column.values for column in block.columns if column.name == field), None)


def _largest(parts: list[FloatArray | None]) -> float:
    finite = [np.abs(part[np.isfinite(part)]) for part in parts if part is not None]
    return max((float(part.max()) for part in finite if len(part)), default=0.0)


def _differing(a: FloatArray | None, b: FloatArray | None, limit: float) -> NDArray[np.intp]:
    """Samples at which two fields differ; NaN equals NaN."""
    if a is None or b is None:
        return np.zeros(0, np.intp) if a is b else np.arange(1)
    with np.errstate(invalid="ignore"):
        near = np.abs(b - a) <= limit
    return np.flatnonzero(~(near | (a == b) | (np.isnan(a) & np.isnan(b))))


def _compare_announcements(old: Output, new: Output, rules: Rules) -> Iterator[Difference]:
    before, after = _described(old.announcements), _described(new.announcements)
    for index in range(max(len(before), len(after))):
        a = before[index] if index < len(before) else {}
        b = after[index] if index < len(after) else {}
        for field in dict.fromkeys((*a, *b)):
            name = f"announcement[{index}].{field}"
            if _same(a.get(field), b.get(field), rules, name) or rules.ignores(
                f"announcement.{field}"
            ):
                continue
            said = b or a
            sample = f"{said['boot']}:{said['seq']}" if "seq" in said else ""
            yield Difference(name, sample, said["t_ns"], _word(a.get(field)), _word(b.get(field)))


def _described(announcements: Sequence[Announcement]) -> list[dict[str, Any]]:
    return [
        {"kind": "alarm" if isinstance(item, Alarm) else "event"} | asdict(item)
        for item in announcements
    ]


def _same(a: Any, b: Any, rules: Rules, field: str) -> bool:
    if isinstance(a, float) and isinstance(b, float):
        limit = rules.tolerance_of(field) * abs(a) if math.isfinite(a) else 0.0
        return a == b or (math.isnan(a) and math.isnan(b)) or abs(b - a) <= limit
    return bool(a == b)


def _word(value: Any) -> str:
    return (
        "nothing" if value is None else f"{value:.9g}" if isinstance(value, float) else repr(value)
    )

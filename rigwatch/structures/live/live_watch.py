"""Online damage detection: sample blocks in; residuals, an alarm and the damage's place out.

    learning ──undamaged seconds──▶ watching ──alarm──▶ gathering ──settle──▶ reported

The undamaged structure is identified from the first seconds, then its model runs beside the samples
(4.34) and the residual is judged as `damage.examine` judges a record. Some seconds after an alarm
the record so far is examined, which names the place. A restarted device begins a new record.

Nothing here reads a clock, bus or file, and samples are processed one by one: the messages are
identical to the bit however the samples are cut into blocks, live or from a recording.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rigwatch.structures.damage import (
    FINER,
    LEAST,
    CumulativeSum,
    Innovations,
    Reference,
    Settings,
    examine,
    reference,
    rounded,
    threshold_for,
)
from rigwatch.structures.model import Structure
from rigwatch.structures.records import GrowingRecord
from rigwatch.structures.report import too_little, verdict
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages import (
    STATISTIC,
    STRUCTURE_DAMAGE,
    Alarm,
    Column,
    EstimateBlock,
    Event,
    SampleBlock,
    Severity,
    cut,
)

Said = EstimateBlock | Alarm | Event

SOURCE = "structure"
CAUSE = "the structure does not move as the undamaged one would"
NAMED = "a damage was named: nothing is watched until the device restarts"
GUIDANCE = "Unload the structure and inspect it. The event DAMAGE names the place within seconds."


@dataclass(frozen=True)
class LiveSettings:
    """Settings of the monitoring of a structure.

    Attributes:
        undamaged: length of the undamaged start, from the first sample on [s].
        rate: probability of any false alarm within `span`.
        span: period that `rate` refers to [s].
        settle: length of data after an alarm used to find its place [s].
        known: take the file's values as true even if it marks them as unknown.
        moving: the structure moves at the first sample, instead of being as in the file; always
            so if the device's first samples were missed.
    """

    undamaged: float = 2.0
    rate: float = 0.01
    span: float = 60.0
    settle: float = 2.0
    known: bool = False
    moving: bool = False


class LiveDamage:
    """A structure monitored online.

    Args:
        structure: the undamaged structure; at its first sample it is in the state of the file.
        dt: time between samples [s].
        settings: settings of the monitoring.

    Raises:
        ModelError: a setting is out of range.
    """

    def __init__(self, structure: Structure, dt: float, settings: LiveSettings) -> None:
        _check(settings)
        self._structure, self._dt, self._settings = structure, dt, settings
        self._learnt = max(1, round(settings.undamaged / dt))
        self._loads = [load.channel for load in structure.loads.values() if load.channel]
        self._boot: int | None = None
        self._idle = ""

    @property
    def idle(self) -> str:
        """Why nothing is watched until the device restarts; empty while it is, or is learnt."""
        return self._idle

    def prepare(self) -> None:
        """Compile the kernels that the first samples need; the state is unchanged."""
        settings = replace(self._settings, known=True, undamaged=LEAST * self._dt)
        trial, count = LiveDamage(self._structure, self._dt, settings), LEAST + 2
        names = (*self._structure.signals, *self._loads)
        # Not 0: a sensor that shows no noise is not judged.
        still = [Column(name, "", np.full(count, 1e-9)) for name in names]
        numbers = np.arange(count)
        trial.update(SampleBlock("", 0, 0, numbers, numbers, tuple(still)))

    def update(self, block: SampleBlock) -> list[Said]:
        """The messages about the next samples.

        Raises:
            ModelError: the block lacks a channel of the structure.
        """
        if block.boot != self._boot:
            self._begin(block)
        lost = block.seq - self._first - len(self._record)
        if lost < 0:
            return self.update(cut(block, -lost, len(block))) if len(block) > -lost else []
        try:
            self._record.take(block, lost)
        except KeyError as error:
            name = self._structure.name
            raise ModelError(f"{name}: found samples without the channel {error}") from None
        return self._messages()

    def _begin(self, block: SampleBlock) -> None:
        self._boot, self._first, self._device = block.boot, block.seq, block.device
        self._record = GrowingRecord(self._dt, self._structure.signals, self._loads)
        self._moving = self._settings.moving or block.seq > 0
        self._stage: Literal["learning", "watching", "gathering", "reported"] = "learning"
        self._done, self._idle = 0, ""

    def _messages(self) -> list[Said]:
        messages, rows, begin = list[Said](), list[FloatArray](), self._done
        settled = self._record.settled
        for row in range(self._done, settled):
            if self._stage == "learning" and row + 1 == self._learnt:
                messages += self._learn(row)
                begin = row + 1
            elif self._stage in {"watching", "gathering"}:
                residual, over = self._beside.step(self._record, row)
                rows.append(residual)
                messages += self._judged(row, over=over)
        self._done = max(self._done, settled)
        return [self._estimates(begin, rows), *messages] if rows else messages

    def _learn(self, row: int) -> list[Said]:
        """The undamaged structure, and the judgement of the same samples."""
        settings, head = self._settings, self._record.record(row + 1)
        try:
            base = reference(
                self._structure,
                head,
                self._learnt * self._dt,
                known=settings.known,
                moving=self._moving,
            )
        except ModelError as error:
            self._stage, self._idle = "reported", str(error)
            return [self._event(row, "error", "NOT WATCHED", self._idle)]
        self._beside = _UndamagedRun(base, settings, self._dt, self._structure.signals)
        self._stage = "watching"
        severity: Severity = "warning" if base.unjudged else "info"
        messages: list[Said] = [self._event(row, severity, "WATCHED", _learnt(base))]
        for past in range(row + 1):
            over = self._beside.step(self._record, past)[1]
            messages += self._judged(past, over=over)
        return messages

    def _judged(self, row: int, *, over: bool) -> list[Said]:
        if self._stage == "watching" and over:
            self._stage, self._alarm = "gathering", row
            return [self._raised(row)]
        if self._stage == "gathering" and (row - self._alarm) * self._dt >= self._settings.settle:
            self._stage, self._idle = "reported", NAMED
            return [self._event(row, "critical", "DAMAGE", self._place(row))]
        return []

    def _place(self, row: int) -> str:
        """What the record up to a row shows, as text."""
        chosen, head = self._settings, self._record.record(row + 1)
        settings = Settings(
            self._learnt * self._dt,
            chosen.rate,
            settle=chosen.settle,
            known=chosen.known,
            moving=self._moving,
        )
        try:
            return verdict(examine(self._structure, head, settings))
        except ModelError as error:
            return f"its place was not found: {error}"

    def _raised(self, row: int) -> Alarm:
        judge, at = self._beside.judge, int(self._record.t_ns[row])
        return Alarm(
            STRUCTURE_DAMAGE, "unacknowledged", "critical", CAUSE, GUIDANCE,
            self._device, self._boot or 0, self._first + row, at,
            judge.value, float("nan"), judge.threshold,
            first_out=True, user="", onset_seq=self._first + row + 1 - judge.zero,
        )  # fmt: skip

    def _event(self, row: int, severity: Severity, code: str,
               text: str) -> Event:  # fmt: skip
        return Event(SOURCE, int(self._record.t_ns[row]), severity, code, text)

    def _estimates(self, begin: int, rows: list[FloatArray]) -> EstimateBlock:
        """Residuals and the statistic over its threshold, from a row on."""
        table, signals = np.array(rows), self._beside.model.signals
        names = [(f"residual_{n}", u) for n, u in zip(signals, self._beside.units, strict=True)]
        columns = tuple(
            Column(name, unit, table[:, k].copy())
            for k, (name, unit) in enumerate([*names, (STATISTIC, "")])
        )
        t_ns = self._record.t_ns[begin : begin + len(rows)].copy()
        return EstimateBlock(self._device, self._boot or 0, self._first + begin, t_ns, columns)


class _UndamagedRun:
    """The undamaged model, run in parallel with the samples one step at a time."""

    def __init__(
        self, base: Reference, settings: LiveSettings, dt: float, signals: Sequence[str]
    ) -> None:
        self.model = base.model
        self._judged = [signals.index(name) for name in base.model.signals]
        system = base.model.problem.system
        self.units = [system.model.outputs[name].unit for name in base.model.signals]
        self._parameters = base.parameters
        self._state = base.model.start()
        self._innovations = Innovations(
            base.model, base.parameters, self._state, base.spread, base.sigma
        )
        self._learnt = base.samples
        samples = rounded(round(settings.span / dt))
        threshold = threshold_for(settings.rate, len(base.sigma), samples, base.freedom)
        self.judge = CumulativeSum(len(base.sigma), threshold)

    def step(self, record: GrowingRecord, row: int) -> tuple[FloatArray, bool]:
        """Residuals and statistic over threshold, shape (m + 1,); and whether that exceeds 1.

        Rows must be passed in order.
        """
        if row:
            self._advance(record, row - 1)
        count = len(self.model.signals)
        outputs, _ = self.model.problem.sweeper.observe(
            record.inputs, record.dt, row, self._state, self._parameters
        )
        observed = record.observed[row, self._judged]
        residual = outputs[:count] - observed
        scaled = self._innovations.update(
            record.inputs, record.dt, row, observed, learnt=row < self._learnt
        )
        over = self.judge.update(scaled)
        return np.append(residual, self.judge.value / self.judge.threshold), over

    def _advance(self, record: GrowingRecord, row: int) -> None:
        problem = self.model.problem
        problem.sweeper.forward(
            record.inputs, record.dt, row, FINER * problem.substeps, self._state, self._parameters
        )
        self._innovations.advance(record.inputs, record.dt, row)


def _check(settings: LiveSettings) -> None:
    if not 0 < settings.rate < 1:
        raise ModelError(f"false alarms: found {settings.rate:g}, expected a number from 0 to 1")
    for name in ("undamaged", "span", "settle"):
        if not (value := getattr(settings, name)) > 0:
            raise ModelError(f"{name}: found {value:g}, expected seconds above 0")


def _learnt(base: Reference) -> str:
    parameters = base.model.problem.system.parameters
    units = {name: parameters[name].unit for name in base.figures if name in parameters}
    found = ", ".join(
        f"{name} = {figure.value:.6g} {units.get(name, '')}".rstrip()
        for name, figure in base.figures.items()
    )
    learnt = f"undamaged structure learnt from {base.samples} samples" + (found and f": {found}")
    return learnt + (f". {too_little(base.unjudged)}" if base.unjudged else "")

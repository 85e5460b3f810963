"""Ranks the probable cause of an alarm in the background, from recent samples.

The ranking itself is in `fault_candidates.py` and runs in a separate process; this module buffers
the samples, requests the ranking and handles the answer.
"""

import queue
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise, starmap

import numpy as np

from monitor.diagnosis.child import Child
from monitor.diagnosis.ranking_job import ask, failed
from monitor.model import RigModel
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import reason_of
from rigwatch.wire.messages import (
    PROBABLY_MISSING,
    Alarm,
    Column,
    EstimateBlock,
    Event,
    SampleBlock,
    concatenate,
    continues,
)

NAMED = ("departure", "dry_friction", "other_fault")
"""Alarms that request an explanation; stiction already has its name."""
FORCE = "friction_force"
"""Column with the force of dry friction [N], of a monitor that estimates it alone."""
WAIT = 2.0
"""Time from the onset to the ranking [s]."""
KEPT = 20.0
"""Length of the buffered samples [s]."""
JOINED = 256
"""Samples that are joined into one block: in blocks as they come they need ten times the memory."""
MAX_ANSWERS = 64
"""Number of answers kept for later listings of alarms."""
Judged = tuple[EstimateBlock, SampleBlock]


class Explainer:
    """Requests one ranking at a time, and never delays samples.

    Args:
        model: returns the current model.
        effect_files: own effects, ranked with the library's.
    """

    def __init__(self, model: Callable[[], RigModel], effect_files: Sequence[str] = ()) -> None:
        self._model, self._files = model, tuple(effect_files)
        self._judged: deque[Judged] = deque()
        self._loose: list[Judged] = []
        self._wanted: Alarm | None = None
        self._friction: tuple[int, int] | None = None
        self._told: dict[tuple[int, int], str] = {}
        self._results: queue.SimpleQueue[tuple[Alarm, Event, str]] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._child = Child()
        self._ended = False

    def take(self, block: EstimateBlock, samples: SampleBlock) -> None:
        """Keep estimates with the samples they are of, and ask where enough have come since an
        alarm's onset.
        """
        rate, alarm = self._model().sample_rate, self._wanted
        self._keep(_needed(block), samples, rate)
        if not alarm or alarm.boot != block.boot or self._busy():
            return
        if block.seq + len(block) - alarm.onset_seq >= WAIT * rate:
            self._wanted = None
            force = _force(block) if self._friction == (alarm.boot, alarm.onset_seq) else 0.0
            arguments = ([*self._judged, *self._loose], alarm, self._model(), force)
            self._thread = threading.Thread(target=self._rank, args=arguments, daemon=True)
            self._thread.start()

    def _keep(self, block: EstimateBlock, samples: SampleBlock, rate: float) -> None:
        """Buffer a block, drop what is too old, and all of an earlier boot."""
        newest = self._loose or self._judged
        if newest and newest[-1][0].boot != block.boot:
            self._judged.clear()
            self._loose.clear()
        self._loose.append((block, samples))
        if block.seq + len(block) - self._loose[0][0].seq >= JOINED:
            self._judged += _joined(self._loose)
            self._loose = []
        while self._judged and self._judged[0][0].seq < block.seq - KEPT * rate:
            self._judged.popleft()

    @property
    def has_results(self) -> bool:
        """Whether answers wait."""
        return not self._results.empty()

    @property
    def waits_for_samples(self) -> bool:
        """Whether a ranking begins once enough samples have come."""
        return self._wanted is not None

    @property
    def loose(self) -> int:
        """Samples kept that are not joined yet: at `JOINED` they are."""
        return sum(len(block) for block, _ in self._loose)

    def hear(self, alarm: Alarm) -> None:
        """Request an explanation if an alarm needs one, once per onset."""
        if alarm.name == "stiction" and alarm.state == "unacknowledged":
            self._wanted = None
        key = (alarm.boot, alarm.onset_seq)
        if alarm.name == "dry_friction":
            self._friction = key
        if alarm.state == "unacknowledged" and alarm.name in NAMED and key not in self._told:
            self._told[key] = ""
            self._wanted = alarm
            while len(self._told) > MAX_ANSWERS:
                self._told.pop(next(iter(self._told)))

    def results(self) -> list[Event]:
        """The answers since the last call."""
        found = [self._results.get() for _ in range(self._results.qsize())]
        for alarm, _, text in found:
            self._told[alarm.boot, alarm.onset_seq] = text
        return [event for _, event, _ in found]

    def with_causes(self, standing: Sequence[Alarm]) -> list[Alarm]:
        """The active alarms, each with the probably missing effect in its cause."""
        return [self._with_cause(alarm) for alarm in standing]

    def _with_cause(self, alarm: Alarm) -> Alarm:
        text = self._told.get((alarm.boot, alarm.onset_seq), "")
        if not text or alarm.name not in NAMED:
            return alarm
        return replace(alarm, cause=f"{alarm.cause}; {text}")

    def close(self) -> None:
        """End a ranking; the interpreter must not end while one is being written or started."""
        self._ended = True
        self._child.end()
        if self._thread is not None:
            self._thread.join()

    def _busy(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _rank(self, judged: Sequence[Judged], alarm: Alarm, model: RigModel, force: float) -> None:
        signals, change = _arrays(judged, model.channels)
        onset = max(alarm.onset_seq - judged[0][0].seq, 0)
        try:
            text = ask(signals, change, onset, model, self._files, self._child)
        except OSError as error:
            text = failed(f"its process could not be started: {reason_of(error)}")
        if self._ended:
            return
        if force > 0.0:
            # The force at the name is of a part of a period, in which contacts are still settling.
            text += f"; the friction is {force:.2g} N by now"
        at = int(judged[-1][0].t_ns[-1])
        event = Event("monitor", at, alarm.severity, PROBABLY_MISSING, f"{alarm.name}: {text}")
        self._results.put((alarm, event, text))


def _force(block: EstimateBlock) -> float:
    """The force of dry friction at the end of a block [N]; 0 if it is not estimated."""
    try:
        return float(block.column(FORCE).values[-1])
    except KeyError:
        return 0.0


def _needed(block: EstimateBlock) -> EstimateBlock:
    """The estimates that a ranking uses: all of them take several megabytes."""
    change = block.column("change")
    kept = Column(change.name, change.unit, change.values.copy(), change.quality)
    return EstimateBlock(block.device, block.boot, block.seq, block.t_ns, (kept,))


def _joined(judged: Sequence[Judged]) -> list[Judged]:
    """The blocks as one, or as they are if something is missing between them."""
    estimates, samples = [one for one, _ in judged], [one for _, one in judged]
    if all(starmap(continues, (*pairwise(estimates), *pairwise(samples)))):
        return [(concatenate(estimates), concatenate(samples))]
    return list(judged)


def _arrays(judged: Sequence[Judged], channels: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Channels, shape (n, channels), and change, shape (n,), of consecutive samples; NaN where
    there is nothing valid.
    """
    first, last = judged[0][0].seq, judged[-1][0]
    count = last.seq + len(last) - first
    signals, change = np.full((count, len(channels)), np.nan), np.full(count, np.nan)
    for block, samples in judged:
        change[block.seq - first :][: len(block)] = block.column("change").values
        at = max(samples.seq - first, 0)
        skipped = at - (samples.seq - first)
        for place, name in enumerate(channels):
            kept = samples.channel(name).usable()[skipped:]
            signals[at : at + len(kept), place] = kept
    return signals, change

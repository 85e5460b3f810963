"""What is probably missing when an alarm stands: ranked in the background on recent samples.

The change from the healthy rig, as the monitor publishes it, is explained by one candidate at a
time. Forces at the mass reach the acceleration through the friction filter Ge; faults of sensor and
drive do not. Each candidate's size is fitted to the first part of the samples since the onset, and
the rest decides, as everywhere: the share of its energy that the candidate takes away.
"""

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from monitor.model_file import RigModel
from rigwatch.physics.transfer_function import FloatArray
from rigwatch.wire.messages import Alarm, EstimateBlock, Event

NAMED = ("departure", "dry_friction", "other_fault")
"""Alarms that ask for an explanation; a mass that sticks has its name."""
WAIT = 2.0
"""Samples since the onset that a ranking waits for [s]."""
KEPT = 20.0
"""Samples that are kept [s]."""
FITTED = 0.6
"""Share of the samples that sizes are fitted to."""
EXPLAINED = 0.7
"""Share of the energy below which no candidate is named."""
EQUAL = 0.03
"""Difference in that share below which two candidates cannot be told apart."""
COLUMNS = ("change", "velocity", "modelled_acceleration", "residual")


@dataclass(frozen=True)
class Candidate:
    """One effect and how much of the change it explains.

    Attributes:
        name: in words.
        explained: share of the energy of samples that its size was not fitted to; at most 1.
    """

    name: str
    explained: float


def rank_candidates(columns: dict[str, FloatArray], model: RigModel) -> list[Candidate]:
    """All candidates, best first.

    Args:
        columns: those of `COLUMNS`, each of shape (n,), consecutive samples.
        model: with the friction filter.
    """
    change = columns["change"]
    good = np.isfinite(np.array([columns[name] for name in COLUMNS])).all(axis=0)
    part = np.arange(len(change)) < FITTED * len(change)
    fitted, judged = good & part, good & ~part
    energy = float(np.sum(change[judged] ** 2))
    found = []
    for label, signal in _signals(columns, model).items():
        power = float(np.sum(signal[fitted] ** 2))
        if power > 0 and energy > 0:
            size = float(np.sum(signal[fitted] * change[fitted])) / power
            left = float(np.sum((change[judged] - size * signal[judged]) ** 2))
            found.append(Candidate(label, 1.0 - left / energy))
    return sorted(found, key=lambda candidate: -candidate.explained)


def in_words(found: list[Candidate]) -> str:
    """The ranking in a sentence."""
    if not found or found[0].explained < EXPLAINED:
        best = f"; the best, {found[0].name}, explains {found[0].explained:.0%}" if found else ""
        return f"probably missing: none of the known effects{best}"
    first = found[0]
    rivals = [c.name for c in found[1:] if c.explained > first.explained - EQUAL]
    text = f"probably missing: {first.name}, explains {first.explained:.0%} of the change"
    return f"{text}; cannot be told from {', '.join(rivals)}" if rivals else text


def _signals(columns: dict[str, FloatArray], model: RigModel) -> dict[str, FloatArray]:
    speed, modelled = (np.nan_to_num(columns[name]) for name in ("velocity", COLUMNS[2]))
    measured = modelled + np.nan_to_num(columns["residual"])
    forces = {
        "dry (Coulomb) friction": np.sign(speed),
        "viscous friction": speed,
        "quadratic drag": speed * np.abs(speed),
        "friction that differs by direction": np.abs(speed),
        "a spring": np.cumsum(speed - speed.mean()) / model.sample_rate,
    }
    through = {name: _through_filter(model, force) for name, force in forces.items()}
    return through | {
        "gain of the accelerometer": measured,
        "offset of the accelerometer": np.ones(len(speed)),
        "lag of the accelerometer": np.gradient(measured),
        "gain of the drive": modelled,
        "delay of the drive": np.gradient(modelled),
    }


def _through_filter(model: RigModel, force: FloatArray) -> FloatArray:
    return model.friction.function().simulate(force)


class Explainer:
    """Ranks in a thread of its own, one alarm at a time, and never makes samples wait.

    Args:
        model: gives the model in force.
    """

    def __init__(self, model: Callable[[], RigModel]) -> None:
        self._model = model
        self._blocks: list[EstimateBlock] = []
        self._wanted: Alarm | None = None
        self._told: set[tuple[int, int]] = set()
        self._results: queue.SimpleQueue[Event] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None

    def take(self, block: EstimateBlock) -> None:
        """Keep estimates, and begin where enough have come since an alarm's onset."""
        if self._blocks and self._blocks[-1].boot != block.boot:
            self._blocks.clear()
        self._blocks.append(block)
        rate, alarm = self._model().sample_rate, self._wanted
        while self._blocks[0].seq < block.seq - KEPT * rate:
            self._blocks.pop(0)
        last = block.seq + len(block)
        if not alarm or alarm.boot != block.boot or self._busy():
            return
        if last - alarm.onset_seq >= WAIT * rate:
            self._wanted = None
            arguments = (list(self._blocks), alarm, self._model())
            self._thread = threading.Thread(target=self._rank, args=arguments, daemon=True)
            self._thread.start()

    def hear(self, alarm: Alarm) -> None:
        """Want an explanation where an alarm that needs one comes up, once an onset."""
        if alarm.name == "stiction" and alarm.state == "unacknowledged":
            self._wanted = None
        key = (alarm.boot, alarm.onset_seq)
        if alarm.state == "unacknowledged" and alarm.name in NAMED and key not in self._told:
            self._told.add(key)
            self._wanted = alarm

    def results(self) -> list[Event]:
        """What has been found since."""
        return [self._results.get() for _ in range(self._results.qsize())]

    def _busy(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _rank(self, blocks: list[EstimateBlock], alarm: Alarm, model: RigModel) -> None:
        since = [b for b in blocks if b.seq + len(b) > alarm.onset_seq]
        columns = {name: np.concatenate([b.column(name).values for b in since]) for name in COLUMNS}
        text = f"{alarm.name}: {in_words(rank_candidates(columns, model))}"
        at = int(since[-1].t_ns[-1])
        self._results.put(Event("monitor", at, alarm.severity, "PROBABLY MISSING", text))

"""The complete monitor, for live use and replay: samples in, estimates and alarms out.

    SampleBlock ─▶ pipeline ──▶ conditions ─▶ alarms ─▶ announcements
                ├▶ detectors ─▶ conditions ─┤
                ├▶ wiring ────▶ conditions ─┤     (silences the two above)
                └▶ quality ───▶ conditions ─┘

It is pure: no clock, bus or file, and the same samples give the same results for any division into
blocks.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from monitor.alarms import AlarmManager, Announcement, SensorFlags, settings_of
from monitor.detectors import Detector
from monitor.model import EquationsPlant, RigModel
from monitor.pipeline.pipeline import Monitor
from monitor.pipeline.result import Result
from monitor.pipeline.steady_kernel import Outputs
from monitor.signals import GAP, SENSOR_CLIPPED, SENSOR_INVALID, Condition, above
from monitor.wiring import DRIVE, WiringCheck
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kept_state import KeptState
from rigwatch.wire.messages import Column, EstimateBlock, SampleBlock, cut
from rigwatch.wire.rig_config import AlarmSection
from rigwatch.wire.wiring_names import WIRING

if TYPE_CHECKING:
    from monitor.pipeline.drive_trial import DriveTrial
    from monitor.pipeline.observer_pipeline import ObserverMonitor

Judged = tuple[EstimateBlock, tuple[Condition, ...]]
"""Estimates of a block, and its conditions."""
OF_SAMPLES = frozenset({GAP, SENSOR_CLIPPED, SENSOR_INVALID})
"""Conditions of the samples themselves, independent of the friction scheme."""


@dataclass(frozen=True, slots=True)
class Watched:
    """Results of one block: estimates, conditions, and messages to announce, in order."""

    estimates: EstimateBlock
    conditions: tuple[Condition, ...]
    announcements: list[Announcement]


class RigMonitor:
    """Pipeline, detectors and alarms of one rig.

    Args:
        model: the model file from commissioning.
        settings: sections of [monitor.alarms].
        detectors: detectors in addition to the friction scheme.
        file: the configuration's name, for errors.
        friction: whether the friction scheme raises alarms; its estimates are always computed.

    Raises:
        ConfigError: a section names no alarm.
    """

    def __init__(
        self,
        model: RigModel,
        settings: Mapping[str, AlarmSection] | None = None,
        detectors: Sequence[Detector] = (),
        file: str = "configuration",
        friction: bool = True,
    ) -> None:
        self.alarms = AlarmManager(settings, file, model.decision.longest_hold)
        self._friction = friction
        self._pipeline = scheme_of(model)
        self._detectors = tuple(detectors)
        self._sensors = SensorFlags(model.sample_rate)
        checked = {name for name in WIRING if settings_of(name, settings or {}).enabled}
        # Who has said that the sensors are as they are to be is not asked for the drive.
        self._wiring = WiringCheck(model, drive=DRIVE in checked) if checked - {DRIVE} else None
        self._trial = trial_of(model) if self._wiring is not None and DRIVE in checked else None

    def update(self, block: SampleBlock) -> Watched | None:
        """Process the next block; None if it contains nothing new.

        Raises:
            KeyError: the block lacks a channel of the model.
        """
        judged = self.judge(block)
        return None if judged is None else Watched(*judged, self.announce(*judged))

    def judge(self, block: SampleBlock) -> Judged | None:
        """Compute estimates and conditions of the next block, to be published before its alarms.

        Raises:
            KeyError: the block lacks a channel of the model.
        """
        result = self._pipeline.update(block)
        return None if result is None else self._completed(result, _fresh(block, result.estimates))

    def follows(self, block: SampleBlock) -> bool:
        """Whether a block can be judged together with others (`together.py`): it continues the
        last one, and no detector or check needs its samples.
        """
        return self._follows(block.boot, block.seq)

    def _follows(self, boot: int, seq: int) -> bool:
        return (
            isinstance(self._pipeline, Monitor)
            and not self._detectors
            and self._pipeline.follows(boot, seq)
            and self._sensors.is_clean(boot)
            and (self._wiring is None or self._wiring.has_passed(boot))
        )

    def at_rest(self, boot: int, seq: int) -> KeptState | None:
        """The state with which samples from this one on are judged in a row; None for none.

        As long as no condition holds at any of them, `went_on` tells all that they change here.
        """
        if not self._follows(boot, seq) or not self.alarms.is_at_rest(boot, seq):
            return None
        return self.steady()

    def went_on(self, samples: int, boot: int, seq: int, t_ns: int) -> None:
        """So many samples have been judged in a row since `at_rest`.

        Args:
            samples: their number.
            boot, seq: the sample after them.
            t_ns: time of the last one [ns].
        """
        assert isinstance(self._pipeline, Monitor)
        self._pipeline.went_on(samples)
        if self._wiring is not None:
            self._wiring.went_on(samples)
        self.alarms.went_on(boot, seq, t_ns)

    def steady(self) -> KeptState | None:
        """The state that `judge_steady` continues with blocks that follow; None if it cannot."""
        return self._pipeline.steady() if isinstance(self._pipeline, Monitor) else None

    def completed(
        self, block: SampleBlock, published: FloatArray, out: Outputs, place: int
    ) -> Judged:
        """The results of a block that `judge_steady` has judged.

        No conditions if none holds and no alarm waits for one.

        Args:
            block: continues the last one.
            published: its `PUBLISHED_ROWS`, shape (columns, n).
            out: what the kernel has filled.
            place: of the rig in `out`.
        """
        assert isinstance(self._pipeline, Monitor)
        at = self._pipeline.passed(block, published)
        if not out.holds[place] and self.alarms.is_idle:
            if self._wiring is not None:
                self._wiring.update(block)
            return at, ()
        outputs = out.columns[place], out.reset[place], out.clipping[place]
        return self._completed(Result(at, self._pipeline.steady_conditions(*outputs)), block)

    def _completed(self, result: Result, fresh: SampleBlock) -> Judged:
        """Add what detectors, wiring check and sensors find in the new samples of a block."""
        at = result.estimates
        found = [detector.update(fresh) for detector in self._detectors]
        if found:
            added = [column for columns, _ in found for column in columns]
            at = replace(at, columns=(*at.columns, *added))
        more = tuple(condition for _, conditions in found for condition in conditions)
        quality = tuple(self._sensors.update(fresh))
        own = result.conditions
        if not self._friction:
            own = tuple(c for c in own if c.name.partition(".")[0] in OF_SAMPLES)
        if self._wiring is None:
            return at, (*own, *more, *quality)
        wrong, wiring = self._wiring.update(fresh)
        if self._trial is not None:
            driven_wrong, found_wrong = self._trial.update(fresh, result)
            wiring = (*wiring, *found_wrong)
            wrong = _either(wrong, driven_wrong)
        wiring = (*wiring, *self._wiring_put_right(wiring, len(fresh)))
        if wrong is not None and wrong.any():
            at = replace(at, columns=tuple(_disarmed(column, wrong) for column in at.columns))
            own, more = (tuple(_silenced(c, wrong) for c in part) for part in (own, more))
        return at, (*own, *more, *wiring, *quality)

    def _wiring_put_right(self, found: tuple[Condition, ...], n: int) -> Iterator[Condition]:
        """That a wiring alarm of an earlier check does not hold any more, in n samples."""
        named = {condition.name for condition in found}
        for name in WIRING:
            if name not in named and self.alarms.holds(name):
                yield above(name, np.zeros(n, np.bool_), np.full(n, np.nan), np.inf)

    def announce(self, at: EstimateBlock, conditions: tuple[Condition, ...]) -> list[Announcement]:
        """Messages of the alarms for conditions, in order."""
        said = self.alarms.update(at.device, at.boot, at.seq, at.t_ns, conditions)
        if self.alarms.has_inherited:
            said += self.alarms.retire((c.name for c in conditions), int(at.t_ns[-1]))
        return said

    @property
    def model(self) -> RigModel:
        """The current model."""
        return self._pipeline.model

    def adopt(self, model: RigModel) -> None:
        """Use another model from the next sample on.

        Raises:
            ModelError: it needs other channels or filters.
        """
        self._pipeline.adopt(model)
        if self._wiring is not None:
            self._wiring.adopt(model)
        if self._trial is not None:
            self._trial.adopt(model)

    def learn(self, block: SampleBlock) -> None:
        """Process a block that an earlier run has published: update the state, publish nothing."""
        result = self._pipeline.update(block)
        for detector in self._detectors:
            detector.update(block)
        if result is None:
            return
        self._sensors.update(_fresh(block, result.estimates))
        if self._wiring is not None:
            self._wiring.update(_fresh(block, result.estimates))
        if self._trial is not None:
            self._trial.update(_fresh(block, result.estimates), result)


def _fresh(block: SampleBlock, judged: EstimateBlock) -> SampleBlock:
    """The part of a block judged in this call, without samples judged before."""
    seen = judged.seq - block.seq
    return cut(block, seen, len(block)) if seen else block


def _either(one: BoolArray | None, other: BoolArray | None) -> BoolArray | None:
    """Where one of two holds; None holds nowhere."""
    if one is None or other is None:
        return other if one is None else one
    return one | other


def _disarmed(column: Column, wrong: BoolArray) -> Column:
    """The column `armed` with 0 while the wiring is wrong; other columns unchanged."""
    if column.name != "armed":
        return column
    return replace(column, values=np.where(wrong, 0.0, column.values))


def _silenced(condition: Condition, wrong: BoolArray) -> Condition:
    """The condition, inactive while the wiring is wrong; conditions of samples are unchanged."""
    if condition.name.partition(".")[0] in OF_SAMPLES:
        return condition
    return condition._replace(active=np.where(wrong, 0, condition.active).astype(np.uint8))


def scheme_of(model: RigModel) -> "Monitor | ObserverMonitor":
    """The scheme for a model's plant.

    Raises:
        ModelError: its equations are invalid.
    """
    if not isinstance(model.plant, EquationsPlant):
        return Monitor(model)
    # Symbolic equations are slow to import.
    from monitor.pipeline.observer_pipeline import ObserverMonitor

    return ObserverMonitor(model)


def trial_of(model: RigModel) -> "DriveTrial | None":
    """The trial of drives for a model's plant; None if it has no equations of one input.

    Raises:
        ModelError: its equations are invalid.
    """
    if not isinstance(model.plant, EquationsPlant):
        return None
    from monitor.pipeline.drive_trial import drive_trial

    return drive_trial(model)


def compile_kernels(model: RigModel, detectors: Sequence[Detector] = ()) -> None:
    """Run every kernel once on a separate monitor, so that the first sample is not delayed.

    Args:
        model: of the rig.
        detectors: separate instances of the configured detectors, which receive zeros.
    """
    n = 4
    zeros = np.zeros(n)
    channels = tuple(Column(name, "", zeros, np.zeros(n, np.uint8)) for name in model.channels)
    times = np.arange(n, dtype=np.int64)
    RigMonitor(model, detectors=detectors).update(SampleBlock("", 0, 0, times, times, channels))

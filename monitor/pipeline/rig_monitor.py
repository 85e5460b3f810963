"""All that the monitor makes of samples, live and in replay alike: estimates and alarms.

    SampleBlock ─▶ pipeline ──▶ conditions ─▶ alarms ─▶ announcements
                ├▶ detectors ─▶ conditions ─┘
                └▶ quality ───▶ conditions ─┘

Pure as its parts are: no clock, bus or file, and the same samples give the same results however
they are cut into blocks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.alarms import AlarmManager, Announcement, quality_conditions
from monitor.detectors import Detector
from monitor.model import EquationsPlant, RigModel
from monitor.pipeline.observer_pipeline import ObserverMonitor
from monitor.pipeline.pipeline import Monitor
from monitor.signals import GAP, SENSOR_CLIPPED, SENSOR_INVALID, Condition
from rigwatch.wire.messages import Column, EstimateBlock, SampleBlock, cut
from rigwatch.wire.rig_config import AlarmSection

OF_SAMPLES = frozenset({GAP, SENSOR_CLIPPED, SENSOR_INVALID})
"""Conditions of the samples themselves, judged whether the friction scheme is wanted or not."""


@dataclass(frozen=True, slots=True)
class Watched:
    """What came of one block: its estimates, its conditions, and what to announce, in order."""

    estimates: EstimateBlock
    conditions: tuple[Condition, ...]
    announcements: list[Announcement]


class RigMonitor:
    """Pipeline, detectors and alarms of one rig.

    Args:
        model: what commissioning found.
        settings: sections of [monitor.alarms].
        detectors: what runs beside the friction scheme.
        file: the configuration's name, for errors.
        friction: whether the friction scheme raises alarms; its estimates are made in any case.

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
        self.alarms = AlarmManager(settings, file)
        self._friction = friction
        self._pipeline = scheme_of(model)
        self._detectors = tuple(detectors)

    def update(self, block: SampleBlock) -> Watched | None:
        """Take the next block; None where it holds nothing new.

        Raises:
            KeyError: the block lacks a channel of the model.
        """
        judged = self.judge(block)
        return None if judged is None else Watched(*judged, self.announce(*judged))

    def judge(self, block: SampleBlock) -> tuple[EstimateBlock, tuple[Condition, ...]] | None:
        """Estimates and conditions of the next block, to be published before its alarms.

        Raises:
            KeyError: the block lacks a channel of the model.
        """
        result = self._pipeline.update(block)
        if result is None:
            return None
        at = result.estimates
        fresh = cut(block, at.seq - block.seq, len(block))
        found = [detector.update(fresh) for detector in self._detectors]
        columns = at.columns + tuple(column for columns, _ in found for column in columns)
        more = tuple(condition for _, conditions in found for condition in conditions)
        quality = tuple(quality_conditions(fresh))
        own = result.conditions
        if not self._friction:
            own = tuple(c for c in own if c.name.partition(".")[0] in OF_SAMPLES)
        return replace(at, columns=columns), (*own, *more, *quality)

    def announce(self, at: EstimateBlock, conditions: tuple[Condition, ...]) -> list[Announcement]:
        """What the alarms say to conditions, in the order in which they were judged."""
        return self.alarms.update(at.device, at.boot, at.seq, at.t_ns, conditions)

    @property
    def model(self) -> RigModel:
        """The model in force."""
        return self._pipeline.model

    def adopt(self, model: RigModel) -> None:
        """Judge with another model from the next sample on.

        Raises:
            ModelError: it asks for other channels or filters.
        """
        self._pipeline.adopt(model)

    def learn(self, block: SampleBlock) -> None:
        """Take a block that an earlier run has judged already: state moves on, nothing is said."""
        self._pipeline.update(block)
        for detector in self._detectors:
            detector.update(block)


def scheme_of(model: RigModel) -> Monitor | ObserverMonitor:
    """The scheme that a model's plant asks for.

    Raises:
        ModelError: its equations do not fit.
    """
    return ObserverMonitor(model) if isinstance(model.plant, EquationsPlant) else Monitor(model)


def compile_kernels(model: RigModel, detectors: Sequence[Detector] = ()) -> None:
    """Run every kernel once on a monitor of its own, so that the first sample does not wait.

    Args:
        model: of the rig.
        detectors: the configured ones, made for this: they are fed with zeros.
    """
    n = 4
    zeros = np.zeros(n)
    channels = tuple(Column(name, "", zeros, np.zeros(n, np.uint8)) for name in model.channels)
    times = np.arange(n, dtype=np.int64)
    RigMonitor(model, detectors=detectors).update(SampleBlock("", 0, 0, times, times, channels))

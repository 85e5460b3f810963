"""The friction scheme as one pure object: sample blocks in, estimates and conditions out.

    SampleBlock ─▶ admission ─▶ residual ─▶ watch (reference, estimates, departure, verdict) ─▶
    Result               └─▶ clipping of each channel ─▶ Result

It uses no clock, bus or file, and every stage works sample by sample with carried state: the same
samples give the same numbers to the last bit, live or in replay, for any division into blocks.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from monitor.clipping import Clipping
from monitor.decision import kernel_state as w
from monitor.decision import rules_for, watch_block
from monitor.model import InertiaPlant, RigModel
from monitor.pipeline.promoted import PromotedFriction, check_can_follow
from monitor.pipeline.result import Result
from monitor.reference import ReferenceRules, new_reference
from monitor.signals import (
    Admission,
    Admitted,
    Condition,
    InertiaResidual,
    TransferResidual,
    above,
    below,
)
from monitor.signals import conditions as kinds
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import Column, EstimateBlock, SampleBlock

PUBLISHED: tuple[tuple[str, str, int], ...] = (
    ("modelled_acceleration", "m/s^2", w.MODELLED),
    ("residual", "m/s^2", w.RESIDUAL),
    ("change", "m/s^2", w.CHANGE),
    ("velocity", "m/s", w.SPEED),
    ("theta1", "", w.THETA1),
    ("theta2", "s/m", w.THETA2),
    ("theta1_low", "", w.LOW1),
    ("theta1_high", "", w.HIGH1),
    ("theta2_low", "s/m", w.LOW2),
    ("theta2_high", "s/m", w.HIGH2),
    ("observable", "", w.OBSERVABLE),
    ("armed", "", w.ARMED_FLAG),
    ("deviation", "", w.DEVIATION),
    ("friction_fit", "", w.EXPLAINED),
    ("friction_share", "", w.SHARE),
    ("rest", "", w.REST),
    ("verdict", "", w.VERDICT),
    ("rho", "", w.RHO),
    ("together", "", w.TOGETHER),
)
"""Columns of an estimate block: name, unit, index in the kernel's output."""


class Monitor:
    """The friction scheme, running.

    Args:
        model: the model file from commissioning.

    Raises:
        KeyError: at `update`, if a block lacks one of the model's channels.
    """

    def __init__(self, model: RigModel) -> None:
        inertia = isinstance(model.plant, InertiaPlant)
        needed = model.channels if inertia else (model.channels[0], model.channels[2])
        self._admission = Admission(
            model.channels, needed, model.decision.longest_hold, model.sample_rate
        )
        self._residual = InertiaResidual(model) if inertia else TransferResidual(model)
        self._follow(model)

    def adopt(self, model: RigModel) -> None:
        """Use another model from the next sample; filters keep their state, estimates restart.

        Raises:
            ModelError: the new model has other filters.
        """
        check_can_follow(self.model, model)
        if isinstance(self._residual, InertiaResidual) and isinstance(model.plant, InertiaPlant):
            self._residual.adopt(model.plant)
        self._follow(model)

    def _follow(self, model: RigModel) -> None:
        """Use the decision rules of this model from the next sample on."""
        self.model, self.rules = model, rules_for(model)
        self._clipping = Clipping(model)
        self._promoted = PromotedFriction(model)
        self._arming = _arming_rules(model)
        self._reference = new_reference(self._arming, _known(model))
        self._state = _new_state(model)

    def update(self, block: SampleBlock) -> Result | None:
        """Process the next block; None if it contains nothing new."""
        admitted = self._admission.admit(block)
        if admitted is None:
            return None
        data = self._residual.update(admitted.signals, admitted.code)
        clipping = self._clipping.update(admitted)
        self._promoted.add(data, admitted.code)
        out = np.zeros((w.OUTPUTS, len(data)))
        watch_block(
            data,
            admitted.code,
            admitted.position_valid,
            int(admitted.seq[0]),
            self.rules,
            self._arming,
            self._reference,
            self._state,
            out,
        )
        result = self._result(block, admitted, out)
        reset = self._residual.reset[admitted.padding :]
        resets = above(kinds.MONITOR_RESET, reset, reset.astype(np.float64), 0.0)
        return replace(result, conditions=(*result.conditions, resets, *clipping))

    def _result(self, block: SampleBlock, admitted: Admitted, out: FloatArray) -> Result:
        kept = out[:, admitted.padding :]
        run = admitted.invalid_run[admitted.padding :]
        estimates = EstimateBlock(
            device=block.device,
            boot=block.boot,
            seq=int(admitted.seq[admitted.padding]),
            t_ns=block.t_ns[len(block) - kept.shape[1] :],
            columns=tuple(Column(name, unit, kept[k]) for name, unit, k in PUBLISHED),
        )
        return Result(estimates, self._conditions(kept, run, admitted.missing))

    def _conditions(
        self, out: FloatArray, run: NDArray[np.int64], missing: int
    ) -> tuple[Condition, ...]:
        rules, decision = self.rules, self.model.decision
        armed = out[w.ARMED_FLAG] > 0.0
        verdict = out[w.VERDICT]
        lost = np.zeros(out.shape[1])
        lost[0] = missing
        invalid = run.astype(np.float64)
        sticks = verdict == w.STICKING
        moving = ~armed | (out[w.SPEED_RMS] >= decision.least_velocity)
        return (
            above(
                kinds.DEPARTURE,
                armed & (out[w.DEVIATION] > rules.factor),
                out[w.DEVIATION],
                rules.factor,
            ),
            above(
                kinds.DRY_FRICTION, armed & ((verdict == w.FRICTION) | sticks), out[w.THETA1], 0.0
            ),
            above(kinds.STICTION, armed & sticks, out[w.REST], 0.5),
            above(kinds.OTHER_FAULT, armed & (verdict == w.OTHER), out[w.EXPLAINED], np.inf),
            above(
                kinds.EXCITATION_CHANGED,
                armed & (verdict == w.NEW_EXCITATION),
                out[w.MOVED_VOLTAGE],
                0.1,
            ),
            above(
                kinds.REFERENCE_LEARNT,
                armed & (out[w.LEARNT_HERE] > 0.0),
                out[w.LEARNT_HERE] / self.model.sample_rate,
                0.0,
            ),
            below(kinds.NOT_OBSERVABLE, ~moving, out[w.SPEED_RMS], decision.least_velocity),
            above(
                kinds.ILL_CONDITIONED,
                armed & (out[w.CONDITION] > decision.worst_condition),
                out[w.CONDITION],
                decision.worst_condition,
            ),
            above(kinds.GAP, lost != 0.0, lost, 0.0),
            above(
                kinds.SENSOR_INVALID, run > decision.longest_hold, invalid, decision.longest_hold
            ),
        )


def _arming_rules(model: RigModel) -> ReferenceRules:
    return ReferenceRules(
        settle=model.decision.settle,
        learn=model.decision.learn,
        longest_period=model.decision.longest_period,
        residual_noise=model.noise.residual,
        position_noise=model.noise.position,
        voltage_noise=model.noise.voltage,
        fixed=model.band is not None,
    )


def _known(model: RigModel) -> list[tuple[FloatArray, float, int]]:
    if model.promoted:
        # Stored periods were modelled without the friction promoted since.
        return []
    return [
        (np.array([r.voltage, r.position, r.acceleration, r.modelled]), r.scale, r.periods)
        for r in model.reference
    ]


def _new_state(model: RigModel) -> w.WatchState:
    longest = max(model.decision.longest_period, model.window.length)
    return w.new_watch_state(longest, *model.friction.function().padded())

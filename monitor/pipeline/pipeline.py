"""The friction scheme as one pure object: sample blocks in, estimates and conditions out.

    SampleBlock ─▶ admission ─▶ residual ─▶ watch (reference, estimates, departure, verdict) ─▶
    Result               └─▶ clipping of each channel ─▶ Result

It uses no clock, bus or file, and every stage works sample by sample with carried state: the same
samples give the same numbers to the last bit, live or in replay, for any division into blocks.
"""

import numpy as np
from numpy.typing import NDArray

from monitor.clipping import Clipping
from monitor.decision import kernel_state as w
from monitor.decision import rules_for, watch_block
from monitor.model import InertiaPlant, RigModel
from monitor.pipeline.promoted import PromotedFriction, check_can_follow
from monitor.pipeline.result import Result
from monitor.reference import ReferenceRules, new_reference, usual
from monitor.signals import (
    GOOD,
    HELD,
    NOTHING,
    Admission,
    Admitted,
    Codes,
    Condition,
    InertiaResidual,
    TransferResidual,
    above,
    level,
)
from monitor.signals import conditions as kinds
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel
from rigwatch.wire.messages import ColumnTable, EstimateBlock, SampleBlock

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
_NAMES = tuple((name, unit) for name, unit, _ in PUBLISHED)
_ROWS = np.array([row for _, _, row in PUBLISHED])


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
        self._missing = 0
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
        self._judged = _judged_by(model)
        self._reference = new_reference(self._arming, _known(model))
        self._state = _new_state(model)

    def update(self, block: SampleBlock) -> Result | None:
        """Process the next block; None if it contains nothing new."""
        admitted = self._admission.admit(block)
        if admitted is None:
            return None
        clipping = self._clipping.update(admitted)
        out = np.zeros((w.OUTPUTS, len(admitted.code)))
        reset = np.zeros(len(admitted.code), np.bool_)
        # What is usual in a gap is known from all samples before it, whatever the blocks.
        end = 0
        while end < len(admitted.code):
            begin, end = end, _end_of_gap(admitted.code, end)
            self._judge(admitted, begin, end, out, reset)
        result = self._result(block, admitted, out)
        reset = reset[admitted.padding :]
        resets = above(kinds.MONITOR_RESET, reset, reset.astype(np.float64), 0.0)
        return Result(result.estimates, (*result.conditions, resets, *clipping))

    def _judge(
        self, admitted: Admitted, begin: int, end: int, out: FloatArray, reset: BoolArray
    ) -> None:
        """Residual and decision of samples `begin` to before `end`, of which the first may be the
        one after a gap.
        """
        code, seq = admitted.code[begin:end], admitted.seq[begin:end]
        data = self._columns(admitted.signals[begin:end], code, seq)
        reset[begin:end] = self._residual.reset
        self._promoted.add(data, code)
        part = np.zeros((w.OUTPUTS, end - begin))
        watch_block(
            data,
            code,
            admitted.position_valid[begin:end],
            int(seq[0]),
            self.rules,
            self._arming,
            self._reference,
            self._state,
            part,
        )
        out[:, begin:end] = part

    def _columns(self, signals: FloatArray, code: Codes, seq: Codes) -> FloatArray:
        if isinstance(self._residual, InertiaResidual):
            return self._residual.update(signals, code)
        return self._residual.update(signals, code, self._usual(code, seq))

    def _usual(self, code: Codes, seq: Codes) -> FloatArray:
        """What is usual for the signals over a gap that ends at the first sample; empty if none
        does.
        """
        missing, self._missing = self._missing, _held_at_end(code, self._missing)
        if code[0] != GOOD or missing == 0:
            return NOTHING
        return usual(self._reference, int(seq[0]) - missing - 1, missing + 2)

    def _result(self, block: SampleBlock, admitted: Admitted, out: FloatArray) -> Result:
        kept = out[:, admitted.padding :]
        run = admitted.invalid_run[admitted.padding :]
        estimates = EstimateBlock(
            device=block.device,
            boot=block.boot,
            seq=int(admitted.seq[admitted.padding]),
            t_ns=block.t_ns[len(block) - kept.shape[1] :],
            columns=ColumnTable(_NAMES, kept[_ROWS]),
        )
        return Result(estimates, self._conditions(kept, run, admitted.missing))

    def _conditions(
        self, out: FloatArray, run: NDArray[np.int64], missing: int
    ) -> tuple[Condition, ...]:
        rules, decision = self.rules, self.model.decision
        n = out.shape[1]
        flags = np.zeros((len(_JUDGED), n), np.uint8)
        rules_of = (rules.factor, decision.least_velocity, decision.worst_condition)
        _flag(out, run, missing, decision.longest_hold, *rules_of, flags)
        lost = np.zeros(n)
        lost[0] = missing
        values = {
            _LEARNT: out[w.LEARNT_HERE] / self.model.sample_rate,
            _GAP: lost,
            _INVALID: run.astype(np.float64),
        }
        return tuple([
            Condition(
                name,
                flags[row],
                values[row] if k < 0 else out[k],
                level(n, low),
                level(n, high),
            )
            for row, (name, k, low, high) in enumerate(self._judged)
        ])  # fmt: skip


_JUDGED: tuple[tuple[str, int], ...] = (
    (kinds.DEPARTURE, w.DEVIATION),
    (kinds.DRY_FRICTION, w.THETA1),
    (kinds.STICTION, w.REST),
    (kinds.OTHER_FAULT, w.EXPLAINED),
    (kinds.EXCITATION_CHANGED, w.MOVED_VOLTAGE),
    (kinds.REFERENCE_LEARNT, -1),
    (kinds.NOT_OBSERVABLE, w.SPEED_RMS),
    (kinds.ILL_CONDITIONED, w.CONDITION),
    (kinds.GAP, -1),
    (kinds.SENSOR_INVALID, -1),
)
"""Conditions, each with the output that is judged; -1 if it is not one alone."""
(
    _DEPARTED, _RUBS, _STICKS, _OTHER, _EXCITED,
    _LEARNT, _STANDS, _ILL, _GAP, _INVALID,
) = range(len(_JUDGED))  # fmt: skip
_HIGH = {_STICKS: 0.5, _OTHER: np.inf, _EXCITED: 0.1, _STANDS: np.inf}
"""Upper limits that no rule of the model gives; 0 for the others."""


@kernel()
def _flag(  # noqa: PLR0917
    out: FloatArray,
    run: NDArray[np.int64],
    missing: int,
    longest_hold: int,
    factor: float,
    least_velocity: float,
    worst_condition: float,
    flags: NDArray[np.uint8],
) -> None:
    """Where each of the conditions `_JUDGED` holds, shape (conditions, n)."""
    for i in range(out.shape[1]):
        armed, verdict = out[w.ARMED_FLAG, i] > 0.0, out[w.VERDICT, i]
        sticks = verdict == w.STICKING
        flags[_DEPARTED, i] = armed and out[w.DEVIATION, i] > factor
        flags[_RUBS, i] = armed and (sticks or verdict == w.FRICTION)
        flags[_STICKS, i] = armed and sticks
        flags[_OTHER, i] = armed and verdict == w.OTHER
        flags[_EXCITED, i] = armed and verdict == w.NEW_EXCITATION
        flags[_LEARNT, i] = armed and out[w.LEARNT_HERE, i] > 0.0
        flags[_STANDS, i] = armed and not out[w.SPEED_RMS, i] >= least_velocity
        flags[_ILL, i] = armed and out[w.CONDITION, i] > worst_condition
        flags[_GAP, i] = i == 0 and missing != 0
        flags[_INVALID, i] = run[i] > longest_hold


def _judged_by(model: RigModel) -> tuple[tuple[str, int, float, float], ...]:
    """The conditions `_JUDGED`, each with its lower and upper limit."""
    decision = model.decision
    low = {_STANDS: decision.least_velocity}
    high = _HIGH | {
        _DEPARTED: rules_for(model).factor,
        _ILL: decision.worst_condition,
        _INVALID: decision.longest_hold,
    }
    return tuple(
        (name, k, float(low.get(row, -np.inf)), float(high.get(row, 0.0)))
        for row, (name, k) in enumerate(_JUDGED)
    )


@kernel()
def _end_of_gap(code: Codes, begin: int) -> int:
    """The first good sample after bridged ones, behind `begin`; else the samples' end."""
    for k in range(begin + 1, code.size):
        if code[k - 1] == HELD and code[k] == GOOD:
            return k
    return code.size


@kernel()
def _held_at_end(code: Codes, before: int) -> int:
    """Number of bridged samples with which the samples end, `before` of them before the first."""
    k = code.size
    while k > 0 and code[k - 1] == HELD:
        k -= 1
    return code.size - k + (before if k == 0 else 0)


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

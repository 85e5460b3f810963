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
from monitor.pipeline.flags import INVALID, JUDGED, LEARNT, MISSING, flag, flagging_of, judged_by
from monitor.pipeline.promoted import PromotedFriction, check_can_follow
from monitor.pipeline.result import Result
from monitor.pipeline.steady_kernel import SteadyState
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
from rigwatch.wire.kept_state import KeptState
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
"""Columns of an estimate block: name, unit, index in the kernel's output, where they come first."""
PUBLISHED_NAMES = tuple((name, unit) for name, unit, _ in PUBLISHED)
PUBLISHED_ROWS = slice(len(PUBLISHED))
"""Rows of the kernel's output that are published; a slice, so that none is copied."""


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
        self._judged, self._flagging = judged_by(model), flagging_of(model)
        self._reference = new_reference(self._arming, _known(model))
        self._state = _new_state(model)
        self._steady: KeptState | None = None

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
        kept = slice(admitted.padding, None)
        estimates = self._estimates(block, out[:, kept])
        run = admitted.invalid_run[kept]
        own = self._all_conditions(out[:, kept], run, admitted.missing, reset[kept])
        return Result(estimates, (*own, *clipping))

    def follows(self, boot: int, seq: int) -> bool:
        """Whether a sample continues the last one, and nothing is pending from before it."""
        return self._missing == 0 and self._admission.continues(boot, seq)

    def steady(self) -> KeptState | None:
        """The state that `judge_steady` continues with blocks that follow; None if it cannot."""
        if self._promoted.adds or not isinstance(self._residual, TransferResidual):
            return None
        if self._steady is None:
            self._steady = KeptState(
                SteadyState(
                    self._admission.steady(),
                    self._clipping.steady(),
                    self._residual.filters,
                    self.rules,
                    self._arming,
                    self._reference,
                    self._state,
                    self._flagging,
                )
            )
        return self._steady

    def went_on(self, samples: int) -> None:
        """So many samples that follow have been judged by the kernel of `steady`."""
        self._admission.passed(samples)

    def passed(self, block: SampleBlock, published: FloatArray) -> EstimateBlock:
        """The estimates of a block that `judge_steady` has judged, from `PUBLISHED_ROWS`."""
        self.went_on(len(block))
        columns = ColumnTable(PUBLISHED_NAMES, published)
        return EstimateBlock(block.device, block.boot, block.seq, block.t_ns, columns)

    def steady_conditions(
        self, out: FloatArray, reset: BoolArray, clipping: FloatArray
    ) -> tuple[Condition, ...]:
        """The conditions of such a block."""
        own = self._all_conditions(out, np.zeros(out.shape[1], np.int64), 0, reset)
        return (*own, *self._clipping.conditions(clipping))

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
        whole = end - begin == out.shape[1]
        part = out if whole else np.zeros((w.OUTPUTS, end - begin))
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
        if not whole:
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

    def _estimates(self, block: SampleBlock, out: FloatArray) -> EstimateBlock:
        skipped = len(block) - out.shape[1]
        seq, t_ns = block.seq + skipped, block.t_ns[skipped:]
        columns = ColumnTable(PUBLISHED_NAMES, out[PUBLISHED_ROWS])
        return EstimateBlock(block.device, block.boot, seq, t_ns, columns)

    def _all_conditions(
        self, out: FloatArray, run: NDArray[np.int64], missing: int, reset: BoolArray
    ) -> tuple[Condition, ...]:
        resets = above(kinds.MONITOR_RESET, reset, reset.astype(np.float64), 0.0)
        return (*self._conditions(out, run, missing), resets)

    def _conditions(
        self, out: FloatArray, run: NDArray[np.int64], missing: int
    ) -> tuple[Condition, ...]:
        n = out.shape[1]
        flags = np.zeros((len(JUDGED), n), np.uint8)
        flag(out, run, missing, self._flagging, flags)
        lost = np.zeros(n)
        lost[0] = missing
        values = {
            LEARNT: out[w.LEARNT_HERE] / self.model.sample_rate,
            MISSING: lost,
            INVALID: run.astype(np.float64),
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

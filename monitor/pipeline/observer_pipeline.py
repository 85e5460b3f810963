"""The observer scheme as one pure object: sample blocks in, estimates and conditions out.

    SampleBlock ─▶ admission ─▶ signals ─▶ range ─▶ decision ─▶ Result
                       └─▶ clipping of each channel ─▶ Result

As in the friction scheme, every stage carries its state from sample to sample, so live and replay
agree to the last bit for any division into blocks. Results refer to the sample `half_width` earlier
and are published with the sample that completes them.
"""

import numpy as np
from numpy.typing import NDArray

from monitor.clipping import Clipping
from monitor.drives import BridgedEdges, RecordedDrives
from monitor.model import EquationsPlant, RigModel
from monitor.observer import (
    EMPTY,
    PREDICTED,
    WEAK,
    WEAKER,
    ChannelJumps,
    E,
    Observed,
    ObserverSignals,
    RangeSeen,
    RemainderTerms,
    UsualError,
    decide,
    drive_energy,
    equations_of,
    friction_limit,
    information_matrix,
    levels,
)
from monitor.observer import decision_state as d
from monitor.pipeline.promoted import check_can_follow
from monitor.pipeline.result import Result
from monitor.signals import Admission, Admitted, Condition, above, below
from monitor.signals import conditions as kinds
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import Column, EstimateBlock, SampleBlock


class ObserverMonitor:
    """The observer scheme, running.

    Args:
        model: with a plant of equations.

    Raises:
        ModelError: its equations are invalid.
        KeyError: at `update`, if a block lacks one of the model's channels.
    """

    def __init__(self, model: RigModel) -> None:
        plant, remainder = model.plant, model.remainder
        assert isinstance(plant, EquationsPlant)
        assert remainder is not None
        self._admission = Admission(
            model.channels, model.channels, model.decision.longest_hold, model.sample_rate
        )
        self._signals = ObserverSignals(plant, remainder, model.sample_rate)
        self._equations = equations_of(plant)
        self._follow(model)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The channels that drive the equations."""
        layout = self._signals.layout
        return layout.channels[: layout.motions[0]]

    def adopt(self, model: RigModel) -> None:
        """Use another model from the next sample, with which every stage begins as at a start.

        Raises:
            ModelError: the new model has other equations.
        """
        check_can_follow(self.model, model)
        assert model.remainder is not None
        self._admission.begin_again()
        self._signals.follow(model.remainder)
        self._follow(model)

    def _follow(self, model: RigModel) -> None:
        plant, remainder = model.plant, model.remainder
        assert isinstance(plant, EquationsPlant)
        assert remainder is not None
        assert model.healthy is not None
        assert model.motion_range is not None
        layout = self._signals.layout
        self.model = model
        self._range = RangeSeen(model, layout.speed)
        self._jumps = ChannelJumps(model.motion_range, self._equations, layout.channels)
        self._edges = [BridgedEdges() for _ in range(layout.motions[0])]
        information = information_matrix(remainder, layout.sensed)
        self._terms = (
            RemainderTerms(remainder, layout.sensed, plant.corner, model.sample_rate)
            if information.size
            else None
        )
        self._state = d.new_state(1 + 2 * len(layout.motions), len(information))
        self._since = 0
        self._recorded = RecordedDrives(model.healthy.steady_drive_energies)
        self._usual = UsualError(model.healthy, model.sample_rate)
        self.rules = d.rules_of(model.healthy, model.sample_rate, plant.corner, information)
        self._clipping = Clipping(model)

    def update(self, block: SampleBlock) -> Result | None:
        """Process the next block; None if it contains nothing new."""
        admitted = self._admission.admit(block)
        if admitted is None:
            return None
        seen = self._signals.update(admitted.signals, admitted.code)
        motion = self._range.motion(seen)
        far = self._range.distance(seen, motion)
        steady = seen.steady & ~self._hidden_edges(admitted)
        jumped = self._jumps.update(admitted.signals, admitted.code)
        out = np.zeros((len(d.OUTPUTS), len(far)))
        layout, remainder = self._signals.layout, self.model.remainder
        assert remainder is not None
        grown = levels(seen.rows[:, list(layout.motions)], seen.judged[:, PREDICTED], remainder)
        if self._terms is not None:
            unsure = self._terms.update(seen.arguments, seen.state)
            grown = np.ascontiguousarray(np.hstack([grown, unsure]))
        speed = np.ascontiguousarray(seen.rows[:, layout.speed])
        inside = (far <= 1.0) | self._recorded.contain(seen.bands)
        known = self.model.motion_range
        assert known is not None
        drive = drive_energy(seen.rows, known, layout.motions)
        usual = self._usual.update(motion, seen.drive, seen.bands)
        decide(
            seen.judged, speed, grown, drive, inside, np.asarray(jumped.any(axis=1)),
            steady, usual.extremes, usual.response, usual.altered, seen.state, self.rules,
            self._state, out,
        )  # fmt: skip
        conditions = self._conditions(admitted, seen, far, out)
        sensors = (*self._jump_conditions(admitted, jumped, out), *self._clipping.update(admitted))
        limit = self._force_limit(out, usual.extremes[d.USUAL_FRICTION])
        estimates = self._estimates(block, admitted, seen, out, limit)
        drive = seen.judged[admitted.padding :, WEAK] / WEAKER
        return Result(estimates, (*conditions, *sensors), drive)

    def _hidden_edges(self, admitted: Admitted) -> NDArray[np.bool_]:
        """Whether missing samples have hidden an edge of an input, shape (n,)."""
        found = np.zeros(admitted.code.size, np.bool_)
        for place, edges in enumerate(self._edges):
            found |= edges.update(
                admitted.signals[:, place], admitted.bridged[:, place], admitted.code
            )
        return found

    def _jump_conditions(
        self, admitted: Admitted, jumped: NDArray[np.bool_], out: FloatArray
    ) -> tuple[Condition, ...]:
        at = admitted.padding
        judged = (jumped & (out[d.MODE] == d.JUDGING)[:, None])[at:]
        return tuple(
            above(f"{kinds.SENSOR_JUMPED}.{name}", judged[:, place], judged[:, place] * 1.0, 0.0)
            for place, name in enumerate(self._jumps.channels)
        )

    def _estimates(
        self,
        block: SampleBlock,
        admitted: Admitted,
        seen: Observed,
        out: FloatArray,
        limit: FloatArray,
    ) -> EstimateBlock:
        at = admitted.padding
        speed = seen.rows[:, self._signals.layout.speed]
        spread = out[d.SPREAD]
        armed = (out[d.MODE] == d.JUDGING) & (seen.state != EMPTY)
        columns: tuple[tuple[str, str, FloatArray], ...] = (
            ("modelled_acceleration", "m/s^2", seen.predicted.output),
            ("residual", "m/s^2", seen.measured - seen.predicted.output),
            ("change", "m/s^2", seen.judged[:, E]),
            ("velocity", "m/s", speed),
            ("theta1", "N", out[d.FORCE]),
            ("theta2", "N s/m", out[d.VISCOUS]),
            ("theta1_low", "N", -limit),
            ("theta1_high", "N", limit),
            ("observable", "", (np.abs(speed) > self.rules.speed_noise).astype(np.float64)),
            ("armed", "", armed.astype(np.float64)),
            ("deviation", "", out[d.DEVIATION]),
            ("friction_fit", "", out[d.SHARE]),
            ("friction_share", "", out[d.DRY_SHARE]),
            ("rest", "", out[d.REST]),
            ("verdict", "", out[d.VERDICT]),
            ("friction_force", "N", out[d.NAMED_FORCE]),
            ("healthy_spread", "m/s^2", spread),
            ("sensors", "", out[d.SENSORS]),
        )
        return EstimateBlock(
            device=block.device,
            boot=block.boot,
            seq=int(admitted.seq[at]),
            t_ns=block.t_ns[len(block) - (len(admitted.seq) - at) :],
            columns=tuple(
                Column(name, unit, np.ascontiguousarray(values[at:], np.float64))
                for name, unit, values in columns
            ),
        )

    def _force_limit(self, out: FloatArray, usual: FloatArray) -> FloatArray:
        """Coulomb force at which the rig has departed [N]; 0 at rest."""
        sizes = np.abs(out[d.DEVIATIONS])
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.abs(out[d.FORCE]) / sizes * friction_limit(usual, self.rules)
        return np.where(sizes > 0.0, found, 0.0)

    def _conditions(
        self, admitted: Admitted, seen: Observed, far: FloatArray, out: FloatArray
    ) -> tuple[Condition, ...]:
        at = admitted.padding
        kept, run = out[:, at:], admitted.invalid_run[at:]
        started = seen.state[at:] != EMPTY
        mode, verdict = kept[d.MODE], kept[d.VERDICT]
        armed = started & (mode == d.JUDGING)
        sticks = verdict == d.STICKING
        force, longest = kept[d.NAMED_FORCE], self.model.decision.longest_hold
        never = np.zeros(len(run), np.bool_)
        lost = np.zeros(len(run))
        lost[0] = admitted.missing
        moving = ~armed | (kept[d.REST] < 1.0)
        waited = self._waited(seen)[at:]
        return (
            above(kinds.DEPARTURE, armed & (kept[d.DEPARTED] > 0.0), kept[d.DEVIATION], 1.0),
            above(
                kinds.DRY_FRICTION,
                started & ((verdict == d.FRICTION) | sticks),
                force,
                0.0,
                told="{:.3g} N of friction",
            ),
            above(kinds.STICTION, armed & sticks, kept[d.REST], 0.5),
            above(kinds.OTHER_FAULT, armed & (verdict == d.OTHER), kept[d.SHARE], np.inf),
            above(kinds.EXCITATION_CHANGED, never, lost * 0.0, 0.0),
            above(kinds.REFERENCE_LEARNT, never, lost * 0.0, 0.0),
            below(kinds.NOT_OBSERVABLE, ~moving, 1.0 - kept[d.REST], 0.0),
            above(kinds.ILL_CONDITIONED, never, lost * 0.0, 0.0),
            above(kinds.NOT_ARMED, ~started | (mode == d.ARMING), waited, 0.0),
            above(kinds.NOT_JUDGED, started & (mode == d.BEYOND), far[at:], 1.0),
            above(
                kinds.DRIVE_LATE,
                armed & (kept[d.FOUND_LATE] != 0.0),
                kept[d.FOUND_LATE],
                0.0,
                told="{:+.2g} samples",
            ),
            above(kinds.GAP, lost != 0.0, lost, 0.0),
            above(kinds.MONITOR_RESET, seen.predicted.reset[at:], lost * 0.0, 0.0),
            above(kinds.SENSOR_INVALID, run > longest, run.astype(np.float64), longest),
        )

    def _waited(self, seen: Observed) -> FloatArray:
        """Time since the start at each sample [s]."""
        found = np.zeros(seen.state.size)
        for k, state in enumerate(seen.state):
            self._since = 0 if state == EMPTY else self._since + 1
            found[k] = self._since / self.model.sample_rate
        return found

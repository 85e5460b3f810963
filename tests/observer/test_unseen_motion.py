"""Motions that were not recorded: how much more a healthy rig leaves there, and larger limits."""

from dataclasses import replace

import numpy as np
import pytest

from monitor.commissioning.equations.unseen_motion import MOST, unseen_ratio
from monitor.model import EquationsPlant
from monitor.observer import (
    E,
    Extremes,
    Observed,
    ObserverSignals,
    decide,
    friction_limit,
    new_state,
)
from monitor.observer import decision_state as d
from monitor.observer.lagged_motion import FIRST, WHOLE
from monitor.observer.missing_force import HELD_LATE, JUDGED, LATE_UNIT
from monitor.signals import GOOD, NEW_BOOT
from tests.monitor.observed_rig import RATE, SINE, UNITS, model, run

RULES = d.DecisionRules(
    0.05, np.zeros(1), 9.0, 4.0, 9.0, 1.0, 0.0, 1.0, 0.01, 256, 192, 2.56, unseen=4.0
)  # fmt: skip


def observed(seed: int, times: float = 1.0) -> Observed:
    """A healthy recording, with `times` the residual."""
    known = model()
    assert isinstance(known.plant, EquationsPlant)
    assert known.remainder is not None
    channels = run(SINE, 8.0, seed=seed)
    code = np.full(round(8.0 * RATE), GOOD)
    code[0] = NEW_BOOT
    signals = ObserverSignals(known.plant, known.remainder, RATE)
    found = signals.update(np.column_stack([channels[name] for name in UNITS]), code)
    judged = found.judged.copy()
    judged[:, E] *= times
    return replace(found, judged=judged)


@pytest.mark.parametrize(("times", "expected"), [(1.0, 1.0), (2.0, 2.0), (20.0, MOST)])
def test_a_recording_is_compared_with_what_all_others_leave(times: float, expected: float) -> None:
    known = model()
    assert known.motion_range is not None
    parts = [observed(3), observed(4), observed(5, times)]

    assert unseen_ratio(known, parts, 2, known.motion_range) == pytest.approx(expected, rel=0.35)


def test_a_model_knows_what_its_rig_leaves_at_motions_that_were_not_recorded() -> None:
    healthy = model().healthy
    assert healthy is not None
    assert 0.0 < healthy.unseen <= MOST


@pytest.mark.parametrize(("usual", "ratio"), [(np.inf, 4.0), (1.0, 1.0)], ids=["unseen", "known"])
def test_limits_grow_only_where_the_motion_was_not_recorded(usual: float, ratio: float) -> None:
    n = 1024
    judged, levels, zeros = np.zeros((n, JUDGED)), np.zeros((n, 1)), np.zeros(n, np.bool_)
    judged[:, E] = 0.2 * np.random.default_rng(1).standard_normal(n)
    state = np.full(n, WHOLE)
    state[0] = FIRST
    deviations = []
    for rules in (RULES, RULES._replace(unseen=1.0)):
        out = np.zeros((len(d.OUTPUTS), n))
        decide(
            judged.copy(), np.ones(n), levels, np.ones(n), ~zeros, zeros, ~zeros,
            np.full((len(Extremes._fields), n), usual), *np.zeros((2, n)), state, rules,
            new_state(1), out,
        )  # fmt: skip
        deviations.append(out[d.DEVIATION, -1])
        assert friction_limit(np.array([np.inf, 1.0]), rules)[1] == pytest.approx(1.6)

    assert deviations[1] == pytest.approx(deviations[0] * np.sqrt(ratio))


@pytest.mark.parametrize(
    ("usual", "late", "soonest", "latest"),
    [(1.0, 0.0, 4, 12), (np.inf, 0.0, 120, 140), (1.0, 2.0, 120, np.inf)],
    ids=["known", "unknown", "a lateness explains it"],
)
def test_a_new_residual_at_a_motion_that_is_known_is_a_departure_at_once(
    usual: float, late: float, soonest: float, latest: float
) -> None:
    n, begin, size = 1024, 768, 0.115
    judged, levels, zeros = np.zeros((n, JUDGED)), np.zeros((n, 1)), np.zeros(n, np.bool_)
    judged[:, E] = 0.03 * np.random.default_rng(1).standard_normal(n)
    judged[begin:, E] += size
    judged[begin:, LATE_UNIT] = judged[begin:, HELD_LATE] = size * late
    state = np.full(n, WHOLE)
    state[0] = FIRST
    out = np.zeros((len(d.OUTPUTS), n))
    # Limits are the same whether the motion is known or not.
    rules = RULES._replace(short=2.56, medium=2.56, unseen=1.0)
    decide(
        judged, np.ones(n), levels, np.ones(n), ~zeros, zeros, ~zeros,
        np.full((len(Extremes._fields), n), usual), *np.zeros((2, n)), state, rules,
        new_state(1), out,
    )  # fmt: skip

    departed = np.flatnonzero(out[d.DEPARTED])
    first = departed[0] - begin if departed.size else np.inf
    assert soonest <= first <= latest
    assert out[d.DEVIATION, begin : begin + 100].max() < 2.0

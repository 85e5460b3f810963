"""Faults under a wave whose edges jitter, as those of a generator that rounds their instants."""

import numpy as np
import pytest

from monitor.observer import decision_state as d
from monitor.observer.decision import decide
from monitor.observer.decision.decision_state import DecisionRules, new_state
from monitor.observer.lagged_motion import FIRST, WHOLE
from monitor.observer.missing_force import JITTERS, JUDGED, UNSURE_INPUT, E
from monitor.observer.usual_error import Extremes

N, BEGIN, NOISE = 1536, 1024, 0.15
RULES = DecisionRules(NOISE, np.zeros(1), 9.0, 5.0, 7.0, 1.0, 0.0, 1.0, 0.0, 256, 192, 1.6**2)


def departs(read_wrongly: float, fault: float, jitters: float) -> bool:
    """Whether a fault of some size is a departure, if the edges are off by a share of a sample."""
    at = np.arange(N)
    late = 2.0 * np.cos(2.0 * np.pi * at / 32.0)
    judged = np.zeros((N, JUDGED))
    judged[:, E] = NOISE * np.random.default_rng(3).standard_normal(N) + read_wrongly * late
    judged[BEGIN:, E] += fault * np.sign(np.sin(2.0 * np.pi * at[BEGIN:] / 32.0))
    judged[:, UNSURE_INPUT], judged[:, JITTERS] = 0.5 * late, jitters
    state = np.full(N, WHOLE)
    state[0] = FIRST
    zeros, out = np.zeros(N, np.bool_), np.zeros((len(d.OUTPUTS), N))
    decide(
        judged, np.ones(N), np.zeros((N, 1)), np.ones(N), ~zeros, zeros, ~zeros,
        np.full((len(Extremes._fields), N), np.inf), *np.zeros((2, N)), state, RULES,
        new_state(1), out,
    )  # fmt: skip
    assert not out[d.DEPARTED, :BEGIN].any()
    assert out[d.MODE, BEGIN] == d.JUDGING
    return bool(out[d.DEPARTED, BEGIN:].any())


@pytest.mark.parametrize(
    ("read_wrongly", "fault", "jitters", "expected"),
    [(0.0, 0.6, 1.0, True), (0.0, 0.6, 0.0, False), (0.5, 0.6, 1.0, False), (0.5, 6.0, 1.0, True)],
    ids=["as read", "not shown", "read wrongly", "read wrongly, strong"],
)
def test_a_fault_is_hidden_only_by_errors_of_edges_that_are_there(
    read_wrongly: float, fault: float, jitters: float, expected: bool
) -> None:
    assert departs(read_wrongly, fault, jitters) is expected

"""A hold that was chosen without the missing effect is chosen again with it."""

from pathlib import Path

import pytest

from rigwatch.workbench.compare import with_hold_decided
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.ranking import rank
from tests.workbench.machine import studied
from tests.workbench.own_machines.test_fit_that_runs_away import RATE, SHIP, rolled
from tests.workbench.simulated import with_few_effects

UNITS = {"moment": "N m", "roll": "rad", "rate": "rad/s"}
CHOSEN = 'horizon = 8.0\nhold = { moment = "zero" }\nholds_chosen = true\n'


def test_it_is_chosen_again_beside_an_effect_that_is_not_slow(tmp_path: Path) -> None:
    logs = [[rolled(seed, softer=0.0, drag=0.9)] for seed in (4, 6)]
    made = studied(tmp_path, SHIP, *logs, UNITS, CHOSEN, [RATE, RATE])
    bench = with_few_effects(open_bench(made), "quadratic_drag")
    rows = rank(bench.study, bench.data, bench.base, bench.floor)
    assert bench.study.holds["moment"].hold == "zero"

    found = with_hold_decided(bench, rows)

    assert found.bench.study.holds["moment"].hold == "linear"
    best = found.rows[0]
    assert (best.label, best.accepted) == ("quadratic_drag@hull", True)
    assert best.fitted is not None
    drag = best.fitted.train.values()["hull_quadratic_drag_b"]
    assert drag == pytest.approx(0.9, rel=0.03)
    before = next(row for row in rows if row.label == best.label)
    assert best.held_out_error < 0.5 * before.held_out_error

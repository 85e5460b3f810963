"""A spring whose middle is not where position reads zero is found by a refinement of the cubic."""

from pathlib import Path

import numpy as np

from rigwatch.wire.kernel import kernel
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.study.study import open_study
from tests.workbench.machine import Table, recorded, studied
from tests.workbench.verdicts.test_refinements import MODEL, RATE, UNITS, run

MIDDLE, CUBIC = 0.004, 4e4


@kernel()
def sprung(u: np.ndarray, cubic: float, steps: int, h: float) -> np.ndarray:
    """Position and acceleration at each sample."""
    out = np.zeros((u.size, 2))
    x = v = s = 0.0
    for n in range(u.size):
        for j in range(steps):
            a = s - 2.0 * v - 100.0 * x - cubic * (x - MIDDLE) ** 3
            if j == 0:
                out[n, 0], out[n, 1] = x, a
            v += h * a
            x += h * v
            s += h * 60.0 * (u[n] - s)
    return out


def logged(seed: int, cubic: float = CUBIC) -> Table:
    return run(seed, cubic, machine=sprung)


def test_the_middle_of_a_stiffening_spring_is_found(tmp_path: Path) -> None:
    made = studied(tmp_path, MODEL, [logged(0)], [logged(1)], UNITS, rates=[RATE, RATE])
    recorded(tmp_path / "healthy.mcap", logged(2, cubic=0.0), UNITS, RATE)
    with (made.folder / "study.toml").open("a") as file:
        file.write('[[healthy]]\nsession = "../healthy.mcap"\n')
    bench = open_bench(open_study(made.folder))

    rows, verdict = ranking(bench)

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == "cubic_stiffness_off_middle@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values["load_cubic_stiffness_off_middle_x0"] - MIDDLE) < 3e-4
    assert abs(values["load_cubic_stiffness_off_middle_k3"] / CUBIC - 1) < 0.05

"""Laws with a middle that is not where position reads zero are found, alone and in pairs."""

from pathlib import Path

import numpy as np

from rigwatch.wire.kernel import kernel
from rigwatch.workbench.compare import Bench, open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.study.study import open_study
from tests.workbench.machine import recorded, studied
from tests.workbench.verdicts.test_refinements import MODEL, RATE, UNITS, Machine, run

MIDDLE, CUBIC, BINDING, DRY = 0.004, 4e4, 20.0, 0.15


@kernel()
def law(x: float, v: float, cubic: float, binding: float, dry: float) -> float:
    """Acceleration by what is hidden."""
    rubbing = (binding * abs(x - MIDDLE) + dry) * np.tanh(v / 1e-4)
    return float(-cubic * (x - MIDDLE) ** 3 - rubbing)


def machine(cubic: float, binding: float, dry: float) -> Machine:
    """A simulation with so much of each law, times the strength."""

    @kernel()
    def moved(u: np.ndarray, strength: float, steps: int, h: float) -> np.ndarray:
        """Position and acceleration at each sample."""
        out = np.zeros((u.size, 2))
        x = v = s = 0.0
        for n in range(u.size):
            for j in range(steps):
                a = s - 2.0 * v - 100.0 * x + strength * law(x, v, cubic, binding, dry)
                if j == 0:
                    out[n, 0], out[n, 1] = x, a
                v += h * a
                x += h * v
                s += h * 60.0 * (u[n] - s)
        return out

    return moved


def bench(folder: Path, hidden: Machine, model: str = MODEL) -> Bench:
    """A study with a healthy recording, fitted."""
    train, held_out, healthy = (run(seed, float(seed < 2), machine=hidden) for seed in range(3))
    made = studied(folder, model, [train], [held_out], UNITS, rates=[RATE, RATE])
    recorded(folder / "healthy.mcap", healthy, UNITS, RATE)
    with (made.folder / "study.toml").open("a") as file:
        file.write('[[healthy]]\nsession = "../healthy.mcap"\n')
    return open_bench(open_study(made.folder))


def test_the_middle_of_a_stiffening_spring_is_found(tmp_path: Path) -> None:
    rows, verdict = ranking(bench(tmp_path, machine(CUBIC, 0.0, 0.0)))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == "cubic_stiffness_off_middle@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values["load_cubic_stiffness_off_middle_x0"] - MIDDLE) < 3e-4
    assert abs(values["load_cubic_stiffness_off_middle_k3"] / CUBIC - 1) < 0.05


def test_the_middle_from_which_a_slide_binds_is_found(tmp_path: Path) -> None:
    rows, verdict = ranking(bench(tmp_path, machine(0.0, BINDING, 0.0)))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == "binding_off_middle@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values["load_binding_off_middle_xm"] - MIDDLE) < 1e-4
    strength = values["load_binding_off_middle_Fb"] / values["load_binding_off_middle_xe"]
    assert abs(strength / BINDING - 1) < 0.05


def test_beside_dry_friction_a_pair_finds_the_middle_of_a_spring(tmp_path: Path) -> None:
    _, verdict = ranking(bench(tmp_path, machine(CUBIC, 0.0, DRY)))

    assert verdict.word in {"missing_effect", "undetermined"}, verdict.text
    named = {*verdict.members, *verdict.second}
    assert {"coulomb@load", "cubic_stiffness_off_middle@load"} <= named

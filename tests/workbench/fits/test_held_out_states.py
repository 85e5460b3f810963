"""Recordings held out tell hidden states only from samples that do not count."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.fit.training import continued_train_error
from rigwatch.workbench.steps.change import add, learn
from rigwatch.workbench.steps.trial import try_effect
from rigwatch.workbench.study.study_file import Accepted
from tests.workbench.dampers import effect
from tests.workbench.machine import studied
from tests.workbench.studies.test_own_model import PORT, SPEED, UNITS

GHOST = (
    effect(
        "ghost",
        "-k*z",
        k="unit = '{F}', role = 'strength'",
        tau="unit = 's', role = 'shape', value = 3.0, low = 0.5, high = 100.0",
    )
    + 'states.z = { unit = "1", derivative = "-z/tau", start = 1.0 }\n'
)
SENSOR = """
[ports.reading]
kind = "sensor"
signal = "v"
"""
CURRENT = """
name = "motor with a winding"
summary = "Speed of a motor whose current no channel shows."
inputs.u = { unit = "V", hold = "zero" }
states.i = { unit = "A", derivative = "(u - v*k - R*i)/L" }
states.v = { unit = "rad/s", derivative = "k*i/J - b*v + load", measured = "v" }
parameters.k = { value = 0.5, unit = "N*m/A", fixed = true }
parameters.R = { value = 1.5, unit = "V/A" }
parameters.L = { value = 0.4, unit = "V*s/A" }
parameters.J = { value = 0.1, unit = "kg*m^2", fixed = true }
parameters.b = { value = 1.0, unit = "1/s" }
outputs.v = { unit = "rad/s", expression = "v" }
"""


def pushed(seed: int, samples: int = 2000) -> dict[str, np.ndarray]:
    """A motor that an outside torque pushes, another one every half second."""
    generator = np.random.default_rng(seed)
    u = np.repeat(generator.normal(size=samples // 50), 50)
    torque = np.repeat(generator.normal(size=samples // 50), 50)
    v = np.zeros(samples)
    for i in range(1, samples):
        v[i] = v[i - 1] + 0.01 * (-2 * v[i - 1] + 3 * u[i - 1] + torque[i - 1])
    return {"u": u, "v": v + 0.005 * generator.normal(size=samples)}


def test_what_remembers_is_no_free_constant_of_each_window(tmp_path: Path) -> None:
    study = studied(tmp_path / "a", SPEED + PORT, [pushed(0)], [pushed(1)], UNITS, "horizon = 0.5")
    own = tmp_path / "own.toml"
    own.write_text(GHOST)
    change = add(learn(study, own)[0], "ghost")
    assert change.step == "refused"
    assert change.tried is not None
    assert change.tried[1] > 0.95 * change.before.held_out_error


def test_training_errors_are_compared_with_states_that_run_on(tmp_path: Path) -> None:
    made = [pushed(seed) for seed in range(2)]
    study = studied(tmp_path, SPEED + PORT + SENSOR, made[:1], made[1:], UNITS, "horizon = 0.5")
    bench, row = open_bench(study), try_effect(study, "ac_coupling", "reading")
    assert row.fitted is not None
    without = bench.base.train_error
    assert row.fitted.train_error < 0.9 * without
    assert continued_train_error(row.fitted, bench.data) > 0.95 * without
    assert continued_train_error(bench.base, bench.data) == without


def wound(seed: int, friction: float, samples: int = 2000) -> dict[str, np.ndarray]:
    """A motor with a winding, and dry friction."""
    generator = np.random.default_rng(seed)
    u = np.repeat(3 * generator.normal(size=samples // 50), 50)
    v, now, i = np.zeros(samples), 0.0, 0.0
    for n in range(1, samples):
        for _ in range(10):
            rate = (u[n - 1] - 0.5 * now - 2 * i) / 0.5
            now += 0.001 * (5 * i - 1.5 * now - friction * np.tanh(now / 0.02))
            i += 0.001 * rate
        v[n] = now
    return {"u": u, "v": v + 0.01 * generator.normal(size=samples)}


def test_a_hidden_current_goes_on_from_the_window_before(tmp_path: Path) -> None:
    made = [wound(seed, 0.0) for seed in range(2)]
    bench = open_bench(studied(tmp_path, CURRENT + PORT, made[:1], made[1:], UNITS))
    left = bench.base.held_out.residuals
    assert np.isnan(left[0]).all()
    assert np.isfinite(left[1:]).all()
    assert bench.base.held_out_error == pytest.approx(0.01, rel=0.15)


def test_a_channel_that_ends_before_the_samples_that_count_is_reported(tmp_path: Path) -> None:
    made = [wound(seed, 0.0) for seed in range(2)]
    made[1]["v"][40:] = np.nan
    study = studied(tmp_path, CURRENT + PORT, made[:1], made[1:], UNITS, "horizon = 0.5")
    with pytest.raises(ModelError, match="found no sample of v that counts"):
        open_bench(study)


@pytest.mark.nightly
def test_with_a_hidden_current_friction_is_named(tmp_path: Path) -> None:
    made = [wound(seed, 1.5) for seed in range(2)]
    found = explain(studied(tmp_path, CURRENT + PORT, made[:1], made[1:], UNITS))
    assert found.ranking[0].effect == "coulomb"


def test_the_samples_that_count_do_not_tell_where_a_window_begins(tmp_path: Path) -> None:
    ghost = [Accepted(effect="lugre", port="load")]
    one, other = pushed(1), pushed(1)
    # Nothing but the last window differs, which no other begins from.
    other["v"][-50:] += 0.5
    left = []
    for name, held in (("a", one), ("b", other)):
        study = studied(tmp_path / name, SPEED + PORT, [pushed(0)], [held], UNITS, "horizon = 0.5")
        left.append(open_bench(study.with_effects(ghost)).base.held_out)
    assert left[0].initial[-1, 1:] == pytest.approx(left[1].initial[-1, 1:], rel=1e-6)

"""Accepted is what lowers the held-out error by more than chance, with a strength that is told."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.explain.explanation import explanation
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking import candidates, rank, rank_only, refit, scored, shapes_of
from rigwatch.workbench.ranking.paired_test import difference
from rigwatch.workbench.report import explanation_lines
from rigwatch.workbench.steps.change import add
from tests.workbench.dampers import damper, effect
from tests.workbench.machine import studied
from tests.workbench.simulated import knowing
from tests.workbench.studies.test_own_model import PORT, SPEED, UNITS

SAMPLES = 2000
SENSOR = '[ports.v_sensor]\nkind = "sensor"\nsignal = "v"\n'


def left(error: np.ndarray) -> Any:
    """A fit that leaves this error of the recordings held out."""
    return SimpleNamespace(residuals=error.reshape(1, -1, 1), scale=np.ones(1))


def transient() -> np.ndarray:
    """What an effect does that shows after one step alone."""
    since = np.maximum(np.arange(SAMPLES) - 700, 0)
    return np.where(since > 0, 3 * np.exp(-since / 30), 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_gain_in_one_transient_alone_counts_and_so_does_a_loss(seed: int) -> None:
    generator = np.random.default_rng(seed)
    noise, missing = 0.3 * generator.normal(size=SAMPLES), transient()
    found = difference(left(noise + missing), left(noise + 0.1 * missing))
    assert found.p_falls < 0.01
    assert found.relative > 0.15
    turned = difference(left(noise + 0.1 * missing), left(noise + missing))
    assert turned.p_rises < 0.01
    assert turned.p_falls > 0.5


@pytest.mark.parametrize("memory", [0.0, 0.97, 0.99])
def test_what_is_not_there_is_accepted_no_oftener_than_the_level_says(memory: float) -> None:
    accepted = 0
    for seed in range(200):
        generator = np.random.default_rng(seed)
        noise, apart = (_remembering(generator, memory) for _ in range(2))
        share = 0.3 * generator.normal()
        accepted += difference(left(noise), left(noise - share * apart)).p_falls < 0.025
    assert accepted <= 0.025 * 200 + 3


def _remembering(generator: np.random.Generator, memory: float) -> np.ndarray:
    """A series each of whose values keeps a share of the one before."""
    new = np.sqrt(1 - memory**2) * generator.normal(size=2 * SAMPLES)
    return np.asarray(lfilter([1.0], [1.0, -memory], new)[SAMPLES:])


def test_samples_count_that_both_have() -> None:
    generator = np.random.default_rng(3)
    noise = generator.normal(size=SAMPLES)
    one, other = noise + 1, noise.copy()
    other[: SAMPLES // 2] = np.nan
    found = difference(left(one), left(other))
    assert found.mean == pytest.approx(np.mean((one**2 - noise**2)[SAMPLES // 2 :]))


def motor(seed: int, levels: list[float], lag: float) -> dict[str, np.ndarray]:
    """Speed of a motor behind a slow sensor, its voltage in steps of five seconds."""
    u = np.repeat(levels, 500)
    v, read = np.zeros(len(u)), np.zeros(len(u))
    for i in range(1, len(u)):
        v[i] = v[i - 1] + 0.01 * (-2 * v[i - 1] + 3 * u[i - 1])
        read[i] = read[i - 1] + 0.01 / lag * (v[i] - read[i - 1])
    return {"u": u, "v": read + 0.005 * np.random.default_rng(seed).normal(size=len(u))}


def test_a_lag_that_one_step_shows_is_accepted(tmp_path: Path) -> None:
    train = motor(0, [0, 1, -1, 0.5, 1], 0.08)
    held = motor(1, [0, 0, 0, 1, 1, 1, 1, 1], 0.08)
    change = add(
        studied(tmp_path, SPEED + PORT + SENSOR, [train], [held], UNITS), "lag", "v_sensor"
    )
    assert change.step == "add"


def rubbing(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    return 3 * np.tanh(v / 0.005)


def wavy(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A force with a period of the travel, beside a little friction."""
    return 4 * np.sin(2 * np.pi * x / 0.011) + 1.5 * np.sign(v)


def ever_denser(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A force that no effect describes, beside a little friction."""
    return 4 * np.sin((x / 0.006) ** 2) + 1.5 * np.tanh(v / 0.003)


TIED = effect(
    "tied",
    "-A*tanh(v/w) - B*tanh(v/(1.02*w))",
    A="unit = '{F}', role = 'strength'",
    B="unit = '{F}', role = 'shape', value = 0.1",
    w="unit = '{v}', role = 'constant', value = 0.005",
)


def test_a_strength_that_may_as_well_be_neutral_is_not_accepted(tmp_path: Path) -> None:
    study = damper(tmp_path, rubbing, TIED)
    bench = open_bench(study)
    shapes = shapes_of(bench.study, bench.data.train, "tied", "load")
    row = rank_only(bench.study, bench.data, bench.base, shapes)
    refit(bench.study, bench.data, bench.base, row)
    assert row.vague
    change = add(study, "tied")
    assert change.step == "refused"
    assert "the training does not determine its strength" in change.text
    assert change.tried is not None
    assert change.tried[1] < 0.5 * change.before.held_out_error


RELIEF = effect(
    "relief",
    "r/(1 + r)*k*(v - max(min(v, vr), -vr))",
    r="unit = '1', role = 'strength', low = 0.0, value = 1.0",
    k="unit = 'N s/m', role = 'constant', value = 300.0",
    vr="unit = '{v}', role = 'shape', value = 0.02, low = 0.005, high = 0.2",
)
"""A valve that opens at a speed; the wider it opens, the less a wider one would change."""


def relieved(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A relief that is as good as complete."""
    return np.asarray(300 * v - 298.5 * (v - np.clip(v, -0.03, 0.03)))


def test_a_strength_that_saturates_is_not_taken_for_a_neutral_one(tmp_path: Path) -> None:
    study = damper(tmp_path, relieved, RELIEF)
    found = explain(knowing(study, "relief", "constant_force", "linear_stiffness"))
    best = found.ranking[0]
    assert (found.verdict, best.effect, best.accepted) == ("missing_effect", "relief", True)
    strength = best.parameters["r"]
    assert strength.interval is not None
    assert strength.interval[0] < 0
    assert strength.note.endswith("but 0 is refuted by the error without it")
    assert best.parameters["vr"].value == pytest.approx(0.03, rel=0.1)


SOFT = effect(
    "soft",
    "-A*tanh(x/w)",
    A="unit = '{F}', role = 'strength'",
    w="unit = '{x}', value = 0.1, low = 0.001, high = 2.0",
)


@pytest.mark.parametrize(
    ("size", "width", "note"), [(20.0, 0.2, "determined only together with w"), (3.0, 0.006, "")]
)
def test_a_strength_that_only_its_shape_leaves_open_is_told_so(
    tmp_path: Path, size: float, width: float, note: str
) -> None:
    bench = open_bench(damper(tmp_path, lambda x, v: size * np.tanh(x / width), SOFT))
    shapes = shapes_of(bench.study, bench.data.train, "soft", "load")
    row = rank_only(bench.study, bench.data, bench.base, shapes)
    refit(bench.study, bench.data, bench.base, row)
    assert row.accepted
    verdict = Verdict("missing_effect", row, (row.label,), (), "")
    found = explanation(bench, [row], verdict)
    strength = found.ranking[0].parameters["A"]
    assert strength.interval is not None
    assert (strength.interval[0] <= 0 <= strength.interval[1]) == bool(note)
    assert strength.note == note
    assert (f", {note};" in explanation_lines(found)[3]) == bool(note)


def test_what_helps_a_little_is_not_called_the_answer(tmp_path: Path) -> None:
    forces = "constant_force", "periodic_force", "coulomb_by_direction", "coulomb", "stribeck"
    found = explain(knowing(damper(tmp_path, ever_denser), *forces))
    assert found.verdict == "unknown_effect"
    assert "92% of the training error's energy remains, 12 times the noise floor" in found.text
    assert "also accepted" in found.text
    assert "stribeck@load" in found.text


def test_two_effects_are_named_of_which_neither_is_much_like_the_residual(tmp_path: Path) -> None:
    found = explain(damper(tmp_path, wavy))
    assert found.verdict == "missing_effect"
    assert {found.ranking[0].effect, *found.also} >= {"periodic_force"}
    assert "coulomb@load" in {*found.beside, *found.also}


def test_a_fit_that_succeeds_leaves_nothing_of_one_that_failed_before(tmp_path: Path) -> None:
    bench = open_bench(damper(tmp_path, lambda x, v: 0.8 * np.sign(v)))
    every = scored(bench.study, bench.data, bench.base, candidates(bench.study, bench.data.train))
    row = next(row for row in every if row.label == "coulomb@load")

    def failing(*_: Any, **__: Any) -> Any:
        raise ModelError("it diverges")

    refit(bench.study, bench.data, bench.base, row, failing)
    assert row.failure == "it diverges"
    row.vague = True
    refit(bench.study, bench.data, bench.base, row)
    assert row.accepted
    assert not row.failure
    assert not row.vague


def test_a_second_pass_tells_of_a_fit_what_the_first_has_told(tmp_path: Path) -> None:
    bench = open_bench(damper(tmp_path, lambda x, v: 0.8 * np.sign(v)))
    study = knowing(bench.study, "coulomb", "linear_stiffness", "cubic_stiffness", "constant_force")
    first = rank(study, bench.data, bench.base, bench.floor)
    told = {row.label: row.reason for row in first if row.fitted is not None}
    assert told["coulomb@load"] == "held-out error falls"
    again = rank(study, bench.data, bench.base, bench.floor, known=first)
    assert {row.label: row.reason for row in again if row.label in told} == told

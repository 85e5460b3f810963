"""A plant of other equations hides something; `benchmarks/explaining` tries many more."""

import numpy as np
import pytest

from rigwatch.workbench.compare.preparation import Bench, bench_of
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking.ranked import accepted_from
from rigwatch.workbench.study.study import Study
from sim_plant.oscillator import UNKNOWN, Hidden, strength_for
from tests.workbench.simulated import (
    HORIZON,
    IN_ANY_LIBRARY,
    knowing,
    multisine,
    recorded,
    size_of,
    study,
)

pytestmark = pytest.mark.long

SEED = 77
NOISE = 2e-3
LINES = np.arange(0.25, 8, 0.25)


def simulated(names: tuple[str, ...], share: float) -> Data:
    """Three recordings under three forces: fitted to, held out, healthy.

    The effects change an output by `share` of its rms, two of them by as much together.
    """
    forces = [multisine(LINES, 4.0, seed=SEED + more) for more in (0, 1000, 2000)]
    each = share / np.sqrt(max(len(names), 1))
    hidden = tuple(Hidden(name, strength_for(name, forces[0], each)) for name in names)
    train, held_out, healthy = (
        recorded(force, effects, NOISE * size_of(force), SEED + more + 7)
        for force, effects, more in zip(forces, (hidden, hidden, ()), (0, 1000, 2000), strict=True)
    )
    return Data(train, held_out, healthy, HORIZON, ())


def explained(of: Study, data: Data) -> tuple[Bench, Verdict]:
    bench = bench_of(of, data, NOISE * np.nanstd(data.train.outputs, axis=0))
    return bench, ranking(bench)[1]


def named(verdict: Verdict) -> set[str]:
    return {*verdict.members, *verdict.rivals}


@pytest.mark.parametrize(
    ("name", "labels"),
    [
        ("coulomb", {"coulomb@load"}),
        ("cubic_stiffness", {"cubic_stiffness@load"}),
        ("valve_hysteresis", {"valve_hysteresis@drive"}),
        pytest.param(
            "acceleration_lag", {"lag@acceleration_sensor", "delay@acceleration_sensor"},
            marks=pytest.mark.nightly,
        ),
    ],
)  # fmt: skip
def test_a_hidden_effect_is_named_and_nothing_but_noise_is_left(
    name: str, labels: set[str]
) -> None:
    bench, verdict = explained(study(), simulated((name,), 0.02))
    assert verdict.word == "missing_effect"
    assert labels & named(verdict)
    assert len(named(verdict)) <= 3
    assert verdict.best is not None
    assert verdict.best.fitted is not None
    assert bench.floor.ratio(verdict.best.fitted.held_out) < 1.1


@pytest.mark.nightly
def test_an_accelerometers_lag_is_not_taken_for_physics() -> None:
    _, verdict = explained(study(), simulated(("acceleration_lag",), 0.05))
    assert verdict.members
    assert all(label.endswith("@acceleration_sensor") for label in named(verdict))


def test_nothing_is_missing_from_a_healthy_plant() -> None:
    bench, verdict = explained(study(), simulated((), 0.0))
    assert verdict.word == "nothing_missing"
    assert bench.floor.ratio(bench.base.held_out) == pytest.approx(1.0, abs=0.1)


@IN_ANY_LIBRARY
def test_what_no_known_effect_explains_is_reported_as_unknown(known: tuple[str, ...]) -> None:
    _, verdict = explained(knowing(study(), *known), simulated((UNKNOWN[0],), 0.05))
    assert verdict.word == "unknown_effect"


@pytest.mark.nightly
@IN_ANY_LIBRARY
def test_two_hidden_effects_are_named_in_two_steps(known: tuple[str, ...]) -> None:
    data = simulated(("coulomb", "cubic_stiffness"), 0.05)
    _, first = explained(knowing(study(), *known), data)
    assert first.best is not None
    found = named(first) | set(first.second)
    if not first.second:
        accepted = (accepted_from(first.best),)
        found |= named(explained(knowing(study(accepted), *known), data)[1])
    assert {"coulomb@load", "cubic_stiffness@load"} <= found

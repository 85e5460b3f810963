"""A log that counts a channel the other way than the model is told so, and no effect is named."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording, joined
from rigwatch.workbench.compare.preparation import Bench, bench_of, open_bench
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.adequacy import reversed_channel
from rigwatch.workbench.explain.explain import explained
from tests.workbench.dampers import stroke
from tests.workbench.machine import studied
from tests.workbench.motors import motor_study
from tests.workbench.simulated import knowing
from tests.workbench.studies.test_recordings_apart import DAMPER, UNITS
from tests.workbench.test_hidden_current import K, R, levels, turned


def counted(seed: int, sign: float, share: float) -> Recording:
    """Speed of a motor with dry friction at a share of full voltage, by a tachometer of a sign."""
    made = turned(share * levels(seed, 800), seed)
    return replace(made, outputs=sign * made.outputs)


def bench(sign: float, share: float = 1.0) -> Bench:
    train = joined([counted(seed, sign, share) for seed in (1, 2)])
    study = knowing(motor_study(R, K), "coulomb", "viscous", "dead_band", "lag")
    return bench_of(study, Data(train, counted(3, sign, share), None, 40, ()))


@pytest.mark.nightly
def test_with_a_speed_that_is_counted_the_other_way_no_effect_is_named() -> None:
    found = explained(bench(-1.0)).explanation
    assert found.verdict == "model_inadequate"
    assert found.text.startswith("voltage seems to be counted the other way than in the model")
    assert "--map 'voltage=COLUMN * -1 [UNIT]'" in found.text


def test_of_friction_that_leaves_as_much_with_the_models_sign_nothing_is_said() -> None:
    slow = bench(1.0, share=0.08)
    assert (slow.base.train.rms > 0.2 * slow.data.train.outputs.std(axis=0)).all()
    assert reversed_channel(slow) is None


def test_of_several_channels_the_one_that_is_reversed_is_told(tmp_path: Path) -> None:
    def pulled(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        return -2 * (3 * v + 40 * x) - 3 * v

    model = DAMPER.replace("c*v - load", "c*v + k*x - load")
    spring = 'parameters.k = { value = 1.0, unit = "N/m", low = 0.0 }'
    model = model.replace("[ports", f"{spring}\n[ports", 1)
    model = model.replace('unit = "N*s/m"', 'unit = "N*s/m", low = 0.0')
    tables = [stroke(seed, pulled) for seed in (0, 1)]
    found = reversed_channel(open_bench(studied(tmp_path, model, tables[:1], tables[1:], UNITS)))
    assert found is not None
    assert found.text.startswith("force seems to be counted the other way")

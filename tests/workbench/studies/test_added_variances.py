"""Intervals of a model that a healthy recording told: what that left uncertain is in them."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.compare.uncertainty_budget import RESPONSE_ERROR, added_variances
from rigwatch.workbench.fit.intervals import values
from rigwatch.workbench.steps.change import add
from rigwatch.workbench.study.creation import create
from rigwatch.workbench.study.study import open_study
from tests.workbench.rigs.test_black_box import record
from tests.workbench.simulated import multisine, opened

STUDY = """
model = "servo-pneumatic"

[[train]]
session = "rig.mcap"
end = 12.0

[[held_out]]
session = "rig.mcap"
start = 12.0

[[healthy]]
session = "healthy.mcap"
"""
DRAG = 0.1


@pytest.mark.nightly
def test_what_is_named_has_an_interval_that_is_wider_than_its_recording_says(tmp_path: Path):
    record(tmp_path, "healthy", 1)
    record(tmp_path, "rig", 2, viscous=DRAG)
    template = tmp_path / "template.toml"
    template.write_text(STUDY, encoding="utf-8")
    study = create(tmp_path / "study", template)
    change = add(study, "viscous", "load")
    assert change.step == "add"
    low, high = change.after.parameters["load_viscous_d"].interval
    assert low < DRAG < high
    accepted = open_bench(open_study(study.folder))
    assert "load_viscous_d" in accepted.base.compiled.system.free
    more = added_variances(accepted.study, accepted.data, accepted.bare, accepted.base)
    assert set(more) == set(accepted.base.compiled.system.free)
    damping = accepted.base.train.values()["load_viscous_d"]
    assert more["load_viscous_d"] > (RESPONSE_ERROR * damping) ** 2
    alone, whole = (values(accepted.base.train, extra) for extra in (None, more))
    for name, variance in more.items():
        assert variance > 0
        assert width(whole[name]) > width(alone[name])


def test_without_a_healthy_recording_that_tells_parameters_nothing_is_added():
    bench = opened(multisine(np.arange(0.5, 8.0, 0.5), 1.0, seconds=5.0))
    assert added_variances(bench.study, bench.data, bench.bare, bench.base) == {}


def width(value) -> float:
    low, high = value.interval
    return high - low

"""A model that the running observer adopts: all of it comes in force, or it is refused."""

import numpy as np
import pytest
from msgspec.structs import replace

from monitor.model import RigModel
from monitor.pipeline.observer_pipeline import ObserverMonitor
from rigwatch.wire.errors import ModelError
from tests.monitor.observed_rig import SINE, block, model, run

pytestmark = pytest.mark.long

ADOPTED = 1024


def narrower() -> RigModel:
    """The model with 0.3 of the range, no drive that was recorded, and no remainder."""
    known = model()
    assert known.motion_range is not None
    assert known.remainder is not None
    low, high = (
        tuple(0.3 * value for value in side)
        for side in (known.motion_range.low, known.motion_range.high)
    )
    assert known.healthy is not None
    none = tuple(0.0 for _ in known.remainder.weights)
    return replace(
        known,
        motion_range=replace(known.motion_range, low=low, high=high),
        remainder=replace(known.remainder, weights=none),
        healthy=replace(known.healthy, steady_drive_energies=()),
    )


def test_an_adopted_model_gives_what_a_start_with_it_gives() -> None:
    channels = run(SINE, 8.0, seed=4)
    monitor = ObserverMonitor(model())
    monitor.update(block(channels, 0, ADOPTED))
    monitor.adopt(narrower())

    adopted = monitor.update(block(channels, ADOPTED))
    started = ObserverMonitor(narrower()).update(block(channels, ADOPTED))

    assert adopted is not None
    assert started is not None
    for one, other in zip(adopted.estimates.columns, started.estimates.columns, strict=True):
        np.testing.assert_array_equal(one.values, other.values, err_msg=one.name)
    for was, now in zip(adopted.conditions, started.conditions, strict=True):
        if was.name != "gap":
            np.testing.assert_array_equal(was.active, now.active, err_msg=was.name)
    beyond = {c.name: c.active for c in adopted.conditions}["not_judged"]
    assert beyond[512:].all()


def test_a_model_of_other_signals_is_refused() -> None:
    known = model()
    assert known.healthy is not None
    fewer = replace(known, healthy=replace(known.healthy, growth=known.healthy.growth[:-1]))

    with pytest.raises(ModelError, match="the new model"):
        ObserverMonitor(model()).adopt(fewer)

"""A rig that rests: hidden states stay, so that a start after a night is one as after minutes."""

from itertools import pairwise

import numpy as np
import pytest
from msgspec import structs

from monitor.model.model_file import RigModel
from monitor.pipeline.observer_pipeline import ObserverMonitor
from tests.monitor.observed_rig import RATE, SINE, block, model, run, watched


def rested(rest_s: float, moving_s: float = 3.0) -> dict[str, np.ndarray]:
    """A recording that begins at rest and moves after some time."""
    moving = run(SINE, moving_s, seed=4)
    still = round(rest_s * RATE)
    return {name: np.concatenate([np.full(still, c[0]), c]) for name, c in moving.items()}


def with_slow_sensor() -> RigModel:
    """The commissioned model, whose accelerometer forgets its mean within several seconds."""
    known = model()
    assert known.plant is not None
    values = dict(zip(known.plant.names, known.plant.values, strict=True))
    values["wa"] *= 0.1
    plant = structs.replace(known.plant, values=type(known.plant.values)(values.values()))
    return structs.replace(known, plant=plant)


def modelled(rest_s: float) -> np.ndarray:
    """What the observer predicts of the motion after a rest."""
    found = watched(rested(rest_s), with_slow_sensor())
    return found.estimates.column("modelled_acceleration").values[round(rest_s * RATE) :]


@pytest.mark.parametrize("rest_s", [20.0, pytest.param(120.0, marks=pytest.mark.nightly)])
def test_a_start_after_a_long_rest_is_one_as_after_a_short_one(rest_s: float) -> None:
    short = modelled(1.0)
    assert np.abs(short).max() > 1.0
    np.testing.assert_allclose(modelled(rest_s), short, atol=1e-9)


def test_block_sizes_change_no_bit_of_a_rest() -> None:
    channels = rested(12.0)
    whole = ObserverMonitor(with_slow_sensor()).update(block(channels))
    assert whole is not None
    cuts = [0, 5, 40, 700, 1500, 2040, 2047, 2048, 2049, 2055, 3000, 3071, 3073, 3090]
    monitor = ObserverMonitor(with_slow_sensor())
    n = len(channels["voltage"])
    parts = [monitor.update(block(channels, a, b)) for a, b in pairwise([*cuts, n])]
    for column in whole.estimates.columns:
        pieces = [part.estimates.column(column.name).values for part in parts if part]
        assert np.array_equal(np.concatenate(pieces), column.values), column.name

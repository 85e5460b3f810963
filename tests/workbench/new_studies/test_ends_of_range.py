"""A reading that stands at the end of its sensor's range is remarked on; one at rest is not."""

from dataclasses import replace

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare.preparation import Bench
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.adequacy import ends_of_range
from rigwatch.workbench.explain.explanation import explanation
from rigwatch.workbench.explain.verdict import Verdict
from tests.workbench.simulated import HORIZON, multisine, opened

NOTHING = Verdict("nothing_missing", None, (), (), "nothing")
FORCE = multisine(np.arange(0.5, 8.0, 0.5), 1.0)


@pytest.fixture(scope="module")
def healthy() -> Bench:
    return opened(FORCE)


def read(bench: Bench, reading: np.ndarray, force: np.ndarray = FORCE) -> Bench:
    """The bench where the first output of its recordings is this reading."""
    outputs = bench.data.train.outputs.copy()
    outputs[:, 0] = reading
    made = Recording(bench.data.train.dt, force[:, None], outputs)
    return replace(bench, data=Data(made, made, None, HORIZON, ()))


def test_a_flat_top_is_told_with_its_value_and_what_to_do(healthy: Bench) -> None:
    position = healthy.data.train.outputs[:, 0]
    top = 0.6 * position.max()
    clipped = read(healthy, np.minimum(position, top))
    (said,) = ends_of_range(clipped)
    assert said.startswith("position: ")
    assert f"stand at exactly {top:.6g} m, its largest, while the inputs change" in said
    assert said in explanation(clipped, [], NOTHING).comparison.remarks


def test_what_varies_to_its_peaks_is_not_remarked_on(healthy: Bench) -> None:
    assert ends_of_range(healthy) == []


def test_what_stands_everywhere_or_rests_is_not_remarked_on(healthy: Bench) -> None:
    position = healthy.data.train.outputs[:, 0]
    coarse = np.round(position / position.std()) * position.std()
    assert ends_of_range(read(healthy, coarse)) == []
    rests = np.arange(len(FORCE)) < 300
    held = np.where(rests, position.max(), position)
    assert ends_of_range(read(healthy, held, np.where(rests, 0.0, FORCE))) == []
    assert ends_of_range(read(healthy, np.maximum(position, 0.0))) == []

"""A promoted friction runs with the samples: however they are cut, and anew after a restart."""

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from monitor.model.model_file import PromotedSection, ReferenceSection, load_model, model_text
from monitor.pipeline.promoted import PromotedFriction
from monitor.signals.admission import GOOD, RESTART
from monitor.signals.residual import MODELLED, VELOCITY
from rigwatch.wire.bus import ModelRequest, ask_for_model
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages import MODELS
from tests.monitor_process.model import MODEL as OF_BENCH
from tests.monitor_process.test_process import Bench
from tests.monitor_process.test_strangers import asked

MODEL = load_model(Path(__file__).parents[1] / "verify" / "model.toml")
KNOWN = structs.replace(MODEL, promoted=PromotedSection(coulomb=0.4, smooth=0.02))


def moving(count: int = 400) -> np.ndarray:
    """Columns of the residual stage: a velocity, and nothing else."""
    columns = np.zeros((count, 7))
    columns[:, VELOCITY] = 0.1 * np.sin(np.arange(count) / 9.0)
    return columns


def added(cuts: list[int], restart: int = -1) -> np.ndarray:
    columns, friction = moving(), PromotedFriction(KNOWN)
    code = np.full(len(columns), GOOD)
    if restart >= 0:
        code[restart] = RESTART
    for first, last in zip([0, *cuts], [*cuts, len(columns)], strict=True):
        friction.add(columns[first:last], code[first:last])
    return columns[:, MODELLED]


@pytest.mark.parametrize("cuts", [[1], [7, 8, 300], [399]])
def test_cuts_change_nothing(cuts: list[int]) -> None:
    assert np.array_equal(added(cuts), added([]))
    assert np.abs(added([])).max() > 0.1


def test_after_a_restart_it_begins_from_rest() -> None:
    begins = added([], restart=200)
    alone, friction = moving()[200:], PromotedFriction(KNOWN)
    friction.add(alone, np.full(len(alone), GOOD))
    assert np.array_equal(begins[200:], alone[:, MODELLED])


def test_without_anything_promoted_nothing_is_added() -> None:
    columns = moving()
    PromotedFriction(MODEL).add(columns, np.full(len(columns), GOOD))
    assert not columns[:, MODELLED].any()


def with_references(count: int, period: int) -> str:
    """A model file with the healthy motion under several slow drives, `period` samples long."""
    column = tuple(np.random.default_rng(1).normal(size=period).tolist())
    columns = dict.fromkeys(("voltage", "position", "acceleration", "modelled"), column)
    one = ReferenceSection(periods=10, scale=1.0, **columns)
    return model_text(structs.replace(OF_BENCH, reference=(one,) * count))


def test_a_model_of_slow_drives_is_promoted_and_told(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    told = bench.observer.subscribe(MODELS)
    large = with_references(3, 512)  # three drives of half a hertz
    for _ in range(2):
        reply = asked(bench, ModelRequest("promote", large, "ann", "a better one"))
        assert reply.done, reply.text
    first, second = told.drain()
    assert first.previous == model_text(OF_BENCH)
    assert (first.model, second.model) == (large, large)
    bench.monitor.close()


def test_a_model_that_cannot_be_told_is_refused_before_anything_changes(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    too_large, path = with_references(4, 960), tmp_path / "model.toml"
    with pytest.raises(ModelError, match="expected at most 262144"):
        ask_for_model(bench.observer, ModelRequest("promote", too_large, "ann", ""))
    bench.monitor.close()
    path.write_text(too_large)
    bench.start()
    assert asked(bench, ModelRequest("promote", model_text(OF_BENCH), "ann", "")).done
    reply = asked(bench, ModelRequest("rollback", "", "ann", ""))
    assert not reply.done
    assert f"{len(too_large)} characters, more than can be told" in reply.text
    assert path.read_text() == model_text(OF_BENCH)
    bench.monitor.close()

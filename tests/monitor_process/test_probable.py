"""An alarm is followed by what is probably missing, ranked without making samples wait."""

import time
from pathlib import Path

import numpy as np
import pytest

from monitor.model_file import load_model
from monitor.probable import Explainer, in_words, rank_candidates
from monitor.rig_monitor import RigMonitor
from rigwatch.wire.blocks import pieces
from rigwatch.wire.messages import Alarm, Event
from rigwatch.wire.session import open_session
from tests.monitor_process.model import MODEL

RECORDINGS = Path(__file__).parents[1] / "verify"
N = 1024


def columns(share: dict[str, float], noise: float = 0.05) -> dict[str, np.ndarray]:
    """A rig moved by two sines whose acceleration changes by shares of some signals."""
    rng = np.random.default_rng(5)
    time = np.arange(N) / MODEL.sample_rate
    speed = 0.3 * np.sin(2 * np.pi * 3.1 * time) + 0.2 * np.sin(2 * np.pi * 0.9 * time)
    modelled = np.gradient(speed, time)
    signals = {
        "dry": np.sign(speed), "viscous": speed, "gain": modelled, "offset": np.ones(N),
        "lag": np.gradient(modelled), "nothing": np.zeros(N),
        "strange": np.sign(np.sin(2 * np.pi * 7.7 * time)),
    }  # fmt: skip
    change = sum(size * signals[name] for name, size in share.items())
    change = change + rng.normal(0, noise, N)
    return {
        "change": change, "velocity": speed, "modelled_acceleration": modelled,
        "residual": change,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("share", "name"),
    [
        ({"dry": -0.5}, "dry (Coulomb) friction"),
        ({"viscous": -1.0}, "viscous friction"),
        ({"offset": 0.3}, "offset of the accelerometer"),
        ({"gain": -0.2}, "gain of the drive"),
    ],
)
def test_the_effect_that_was_put_in_comes_first(share: dict[str, float], name: str) -> None:
    found = rank_candidates(columns(share), MODEL)
    assert found[0].name == name
    assert found[0].explained > 0.8


@pytest.mark.parametrize("share", [{"nothing": 0.0}, {"strange": 0.5}])
def test_nothing_is_named_where_nothing_explains_it(share: dict[str, float]) -> None:
    assert "none of the known effects" in in_words(rank_candidates(columns(share), MODEL))


def test_samples_without_a_residual_do_not_count() -> None:
    holed = columns({"dry": -0.5})
    holed["change"][100:200] = np.nan
    assert rank_candidates(holed, MODEL)[0].name == "dry (Coulomb) friction"


def test_friction_on_the_simulated_rig_is_named_after_its_alarm() -> None:
    model = load_model(RECORDINGS / "model.toml")
    monitor, explainer = RigMonitor(model), Explainer(lambda: model)
    for whole in open_session(RECORDINGS / "friction.mcap").samples():
        for block in pieces(whole, 16):
            watched = monitor.update(block)
            assert watched is not None
            explainer.take(watched.estimates)
            for said in watched.announcements:
                if isinstance(said, Alarm):
                    explainer.hear(said)
    found: list[Event] = []
    deadline = time.monotonic() + 60.0
    while not found and time.monotonic() < deadline:
        found = explainer.results()
        time.sleep(0.01)
    assert len(found) == 1
    assert found[0].code == "PROBABLY MISSING"
    assert "probably missing: dry (Coulomb) friction" in found[0].text

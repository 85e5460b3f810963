"""A new study says how many effects are tried, and an unknown one how the others are."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy

from rigwatch.commands import main
from rigwatch.workbench.ranking import suitable
from rigwatch.workbench.study import open_study
from tests.workbench.studies.test_recordings_apart import DAMPER

WITH_OIL = DAMPER.replace("c*v -", "thickness*c*v -").replace(
    "outputs.", 'parameters.thickness = { value = 1.0, unit = "1", fixed = true }\noutputs.'
)


Law = Callable[[np.ndarray, np.ndarray], np.ndarray]


def stop_below(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A rubber stop on one side."""
    return 60 * np.minimum(x + 0.011, 0.0)


def far_stop_below(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A rubber stop at three times the usual stroke, which a resonance reaches now and then."""
    return 60 * np.minimum(x + 0.033, 0.0)


def stop_and_drag(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A rubber stop on one side, and a drag that grows with the square of the speed."""
    return stop_below(x, v) + 60 * v * np.abs(v)


def soft_stop_below(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A soft stop on one side, which a stop on both sides and a bent spring make up together."""
    return 2 * np.minimum(x + 0.011, 0.0)


def binding(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Dry friction at one place of the stroke."""
    return 0.2 * np.tanh(v / 0.002) * np.exp(-(((x - 0.008) / 0.002) ** 2))


def nothing(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """No force besides the damper's."""
    return np.zeros(len(x))


def behind_gap(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A slider on a spring that the rod pushes through a gap of 6 mm."""
    pushed, force = 0.0, np.zeros(len(x))
    for i in range(1, len(x)):
        before, pushed = pushed, float(np.clip(pushed, x[i] - 0.003, x[i] + 0.003))
        force[i] = np.clip(force[i - 1] + 100.0 * (pushed - before), -0.4, 0.4)
    return force


def weak_gap(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The same slider, so weak that one without a gap leaves little more than noise."""
    return 0.01 * behind_gap(x, v)


def logged(
    path: Path, seed: int, law: Law | None = None, stroke: float = 0.01, burst: float = 0.0
) -> str:
    """A damper with a force by a law, or one that something else pushes at random, slowly.

    For a second its stroke is larger, by `burst` times the usual.
    """
    draws = np.random.default_rng(seed).normal(size=(2, 1500))
    t = np.arange(1500) / 100
    stroke = stroke * (1.0 + burst * np.exp(-(((t - 7.0) / 0.7) ** 2)))
    x = stroke * (np.sin((2 + 0.3 * seed) * t) + np.sin(3.3 * t + 0.05 * t**2 + seed))
    v = np.gradient(x, 0.01)
    hidden = scipy.signal.lfilter([0.1], [1, -0.9], draws[0]) if law is None else law(x, v)
    force = 3 * v + hidden + (0.01 if law is None else 0.004) * draws[1]
    lines = ["time_s,x [m],v [m/s],force [N]"]
    lines += [",".join(f"{value:.6g}" for value in row) for row in zip(t, x, v, force, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return f"{path}"


def begun(folder: Path, logs: list[str]) -> Path:
    """The folder of a study of these logs of a damper."""
    model, made = folder / "damper.toml", folder / "study"
    model.write_text(WITH_OIL)
    assert main(["study", "new", f"{made}", "--data", *logs, "--model", f"{model}"]) == 0
    return made


def explained(folder: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """What `rigwatch explain --json` prints of a study."""
    capsys.readouterr()
    assert main(["explain", f"{folder}", "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))


def test_rarer_effects_are_counted_apart_and_offered_where_none_explains_the_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = [logged(tmp_path / f"run{seed}.csv", seed) for seed in (1, 2)]
    folder = begun(tmp_path, logs)
    tried, rarer = suitable(open_study(folder))
    assert {"coulomb", "jenkins"} <= set(tried)
    assert {"maxwell_slip", "jenkins_behind_gap"} <= set(rarer)
    assert "radiation" not in {*tried, *rarer}
    said, count = capsys.readouterr().out, len(tried) + len(rarer)
    assert f"{count} effects suit its ports: {len(tried)} are tried at once" in said
    assert f"{len(rarer)} rarer ones if none of those explains the error" in said

    assert main(["explain", f"{folder}"]) == 0
    out = capsys.readouterr().out
    assert "something is missing that no known effect explains" in out
    assert f"nor is it like one of {len(rarer)} rarer ones" in out
    assert "--whole-library" not in out
    assert f"next: rigwatch locate {folder} shows where the model fails" in out
    file = folder / "study.toml"
    own_value = f"set this machine's under [start] in {file}"
    assert f"note: thickness: taken from the model file; {own_value}" in out
    file.write_text(f"whole_library = true\n{file.read_text()}")
    assert suitable(open_study(folder))[1] == []


@pytest.mark.parametrize(
    ("law", "name"),
    [
        (stop_below, "stop_below"),
        (binding, "local_binding"),
        pytest.param(
            behind_gap,
            "jenkins_behind_gap",
            id="coarser friction leaves much",
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_a_rarer_effect_is_named_in_a_second_pass(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], law: Law, name: str
) -> None:
    logs = [logged(tmp_path / f"run{seed}.csv", seed, law) for seed in (1, 2)]
    folder = begun(tmp_path, logs)
    rarer = len(suitable(open_study(folder))[1])
    assert main(["explain", f"{folder}"]) == 0
    out = capsys.readouterr().out
    assert f"{name}@load is missing" in out
    assert f"it was found among {rarer} rarer effects, as no usual one explains the error" in out
    assert "the probability of being wrong is unknown: the effect was found in a second" in out
    assert f"next: rigwatch add {folder} {name} --port load" in out


def test_a_rarer_effect_beside_a_usual_one_is_named_with_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = [logged(tmp_path / f"run{seed}.csv", seed, stop_and_drag) for seed in (1, 2)]
    found = explained(begun(tmp_path, logs), capsys)
    assert found["verdict"] == "missing_effect"
    assert {"stop_below@load", "quadratic_drag@load"} <= set(re.findall(r"\w+@load", found["text"]))
    assert found["remains"] == 0.0


def test_a_stop_that_is_rarely_reached_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = [logged(tmp_path / f"run{seed}.csv", seed, far_stop_below, burst=2.5) for seed in (1, 6)]
    found = explained(begun(tmp_path, logs), capsys)
    best = found["ranking"][0]
    assert found["verdict"] == "missing_effect"
    assert best["effect"] == "stop_below"
    assert best["parameters"]["xs"]["value"] == pytest.approx(0.033, rel=0.02)
    assert best["parameters"]["k"]["value"] == pytest.approx(60.0, rel=0.05)


@pytest.mark.parametrize(
    ("law", "word", "told"),
    [
        pytest.param(
            stop_below, "undetermined", "but stop_below@load", id="hidden in the training"
        ),
        pytest.param(nothing, "nothing_missing", "and no effect lowers it", id="nothing hidden"),
    ],
)
def test_an_effect_that_only_the_training_reaches_is_undetermined(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], law: Law, word: str, told: str
) -> None:
    logs = [
        logged(tmp_path / f"run{seed}.csv", seed, law, stroke)
        for seed, stroke in ((1, 0.01), (2, 0.005))
    ]
    found = explained(begun(tmp_path, logs), capsys)
    assert found["verdict"] == word
    assert told in found["text"]
    if word == "undetermined":
        assert found["ranking"][0]["effect"] == "stop_below"
        assert "the training alone asks for the effect" in found["unlike"]
        assert found["wrong_probability"] is None


@pytest.mark.parametrize(
    ("law", "rival", "told"),
    [
        pytest.param(soft_stop_below, "stop_below@load", "as little alone", id="of a set"),
        pytest.param(
            weak_gap,
            "jenkins_behind_gap@load",
            r"[\d.]+ N of the training, jenkins@load [\d.]+$",
            id="of one",
        ),
    ],
)
def test_a_rarer_effect_like_those_named_is_a_rival_if_it_leaves_less_or_is_simpler(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], law: Law, rival: str, told: str
) -> None:
    logs = [logged(tmp_path / f"run{seed}.csv", seed, law) for seed in (1, 2)]
    found = explained(begun(tmp_path, logs), capsys)
    assert found["verdict"] == "undetermined"
    assert found["rivals"] == [rival]
    assert re.search(f"{rival} leaves {told}", found["text"])

"""The last accepted effect exchanged for a relative that describes the same physics better."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain import explain
from rigwatch.workbench.explain.exchange import exchange, of_a_kind
from rigwatch.workbench.ranking import no_progress
from rigwatch.workbench.steps.change import add, undo
from rigwatch.workbench.study import Accepted, open_study
from tests.workbench.dampers import damper
from tests.workbench.simulated import knowing

explain_module = import_module("rigwatch.workbench.explain.explain")

STIFFNESS, LIMIT, MORE, SLOW = 8e3, 20.0, 0.4, 0.015


def slider_behind(gap: float):
    """Force of a spring with a dry slider whose pin has play of a width [m], stepped by hand."""

    def force(x: np.ndarray, _: np.ndarray) -> np.ndarray:
        behind = stretched = 0.0
        found = np.empty_like(x)
        for index, place in enumerate(x):
            moved = min(max(behind, place - gap / 2), place + gap / 2) - behind
            behind += moved
            stretched = float(np.clip(stretched + STIFFNESS * moved, -LIMIT, LIMIT))
            found[index] = stretched
        return found

    return force


@pytest.mark.parametrize(
    ("gap", "offered"),
    [
        pytest.param(0.003, "jenkins_behind_gap", id="wide", marks=pytest.mark.nightly),
        pytest.param(
            0.0008,
            "jenkins_behind_gap",
            id="narrow, for which a drag stands in",
            marks=pytest.mark.nightly,
        ),
        pytest.param(0.0, None, id="none"),
    ],
)
def test_a_slider_that_turns_out_to_be_behind_play_is_offered_in_its_place(
    tmp_path: Path, gap: float, offered: str | None
) -> None:
    study = damper(tmp_path, slider_behind(gap))
    add(study, "jenkins", "load")
    before = explain(open_study(study.folder))
    found = before.exchange
    assert (found.effect if found else None) == offered
    assert before.verdict != "missing_effect"
    if found is None:
        return
    assert "in place of jenkins@load" in before.text
    assert f"rigwatch add {study.folder} {found.effect} --port load)" in before.text
    undo(open_study(study.folder))
    after = add(open_study(study.folder), found.effect, found.port).after
    assert after.held_out_error == pytest.approx(found.held_out_error, rel=0.05)
    assert after.held_out_error < before.comparison.held_out_error


def test_what_stands_in_its_place_is_sought_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rarer effects are tried where the usual ones explain little; the exchange knows them all."""

    def force(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        rest = 6 * np.sin(x / 1e-3) * np.cos(v / 0.02)
        return np.asarray(LIMIT * np.tanh(v / 1e-3) + 40 * np.tanh(v / 0.03) + rest)

    made = knowing(damper(tmp_path, force), "coulomb", "digressive_damping", "gain")
    study = made.with_effects([Accepted(effect="coulomb", port="load", parameters={"Fc": LIMIT})])
    sought: list[str] = []
    monkeypatch.setattr(explain_module, "exchange", lambda *_: sought.append("exchange"))
    assert explain(study, sought.append).verdict == "unknown_effect"
    assert [said for said in sought if said in ("exchange", "trying 2 effects at once")] == [
        "exchange",
        "trying 2 effects at once",
    ]


def held_harder_at_low_speed(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Force of a spring whose slider yields by a power law of the speed, returned to its limit."""
    stretched, found = 0.0, np.empty_like(x)
    for index, step in enumerate(np.diff(x, prepend=x[0])):
        limit = LIMIT * (1 + MORE / (1 + abs(v[index]) / SLOW))
        stretched = float(np.clip(stretched + STIFFNESS * step, -limit, limit))
        found[index] = stretched
    return found


@pytest.mark.nightly
def test_a_slider_that_holds_harder_at_low_speed_is_offered_for_a_constant_one(
    tmp_path: Path,
) -> None:
    study = damper(tmp_path, held_harder_at_low_speed)
    before = add(study, "jenkins", "load").after
    bench = open_bench(open_study(study.folder))
    found = exchange(bench, no_progress)
    assert found is not None
    assert found.effect == "elastoplastic"
    undo(open_study(study.folder))
    after = add(open_study(study.folder), found.effect, found.port).after
    assert after.held_out_error == pytest.approx(found.held_out_error, rel=0.05)
    assert after.held_out_error < 0.4 * before.held_out_error
    values = {name.split("_")[-1]: v.value for name, v in after.parameters.items()}
    assert values["Fc"] * values["s"] == pytest.approx(STIFFNESS, rel=0.05)
    assert values["Fc"] == pytest.approx(LIMIT, rel=0.1)
    # What it contains cannot describe it better.
    assert "jenkins" not in of_a_kind(open_study(study.folder), "elastoplastic", "load")

"""EMPS in four commands: the error falls from 9.8 N to 2 N, and two effects are refused."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from rigwatch.commands import main
from tests.workbench.conftest import CONFIGS

Told = Callable[..., tuple[int, Any]]
PUBLISHED = {"M": 95.11, "Fv": 203.5, "load_coulomb_Fc": 20.39, "load_constant_force_F0": 3.165}
"""Janot, Gautier and Brunot, 2019; their offset stands on the other side of the equation."""


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Told:
    """A command's exit code and the JSON that it prints."""

    def run(*arguments: str) -> tuple[int, Any]:
        capsys.readouterr()
        code = main([*arguments, "--json"])
        out = capsys.readouterr().out
        return code, json.loads(out) if out.strip() else None

    return run


@pytest.fixture
def study(emps: Path, tmp_path: Path, told: Told) -> str:
    folder = str(tmp_path / "study")
    template = str(CONFIGS / "studies" / "emps.toml")
    assert told("study", "new", folder, "--template", template, "--sessions", str(emps))[0] == 0
    return folder


@pytest.mark.long
@pytest.mark.parametrize(
    "decoys",
    [
        pytest.param(("stribeck",), id="one"),
        pytest.param(
            ("stribeck", "position_dependent", "end_binding"), id="all", marks=pytest.mark.nightly
        ),
    ],
)
def test_the_error_falls_from_ten_newtons_to_two_and_decoys_are_refused(
    study: str,
    tmp_path: Path,
    told: Told,
    monkeypatch: pytest.MonkeyPatch,
    decoys: tuple[str, ...],
) -> None:
    # The viewer's notices may be in the picture.
    monkeypatch.setattr("rigwatch.dashboard.viewer.picture._FRAMES", 8)
    _, start = told("compare", study)
    assert start["train_error"] == pytest.approx(9.49, abs=0.02)
    assert start["held_out_error"] == pytest.approx(9.77, abs=0.02)
    assert start["unit"] == "N"
    # What each step names is explained in the browser's story.
    steps = [("coulomb", 4.08), ("constant_force", 2.51), ("viscous_by_direction", 2.01)]
    for effect, error in steps:
        code, change = told("add", study, effect, "--port", "load")
        assert code == 0
        assert change["after"]["held_out_error"] == pytest.approx(error, abs=0.02)
        if effect == "constant_force":
            parameters = change["after"]["parameters"]
            for name, value in PUBLISHED.items():
                assert parameters[name]["value"] == pytest.approx(value, rel=0.0101)
    before = (Path(study) / "study.toml").read_bytes()
    for decoy in decoys:
        code, change = told("add", study, decoy)
        assert code == 1
        assert change["step"] == "refused"
        assert change["after"]["held_out_error"] < 2.05
    assert (Path(study) / "study.toml").read_bytes() == before
    _, shown = told("study", "show", study)
    assert [line["step"] for line in shown["ledger"]] == [
        "new",
        *["add"] * 3,
        *["refused"] * len(decoys),
    ]
    code, checks = told("study", "replay", study)
    assert code == 0
    assert len(checks) == 3
    picture = tmp_path / "emps.png"
    code, drawn = told("study", "view", study, "--picture", str(picture))
    assert code == 0
    assert drawn["steps"] == ["model alone", *(f"+ {e.replace('_', ' ')}" for e, _ in steps)]
    assert len(np.unique(np.asarray(Image.open(picture)).reshape(-1, 3), axis=0)) > 50


def test_undo_brings_the_file_back_as_it_was(study: str, told: Told) -> None:
    file = Path(study) / "study.toml"
    before = file.read_text()
    told("add", study, "coulomb")
    assert "coulomb" in file.read_text()
    code, change = told("undo", study)
    assert code == 0
    assert change["after"]["held_out_error"] == pytest.approx(9.77, abs=0.02)
    assert file.read_text().rstrip() == before.rstrip()
    assert main(["undo", study]) == 2


def test_where_it_fails_is_reported_with_samples(study: str, told: Told) -> None:
    _, regions = told("locate", study)
    views = {region["view"] for region in regions}
    assert views >= {"time", "motion", "direction", "amplitude", "frequency"}
    sides = {r["name"]: r for r in regions if r["view"] == "direction"}
    # Friction that is missing pushes one way going out and the other way coming back.
    assert sides["forward"]["mean"] * sides["backward"]["mean"] < 0
    assert all(len(r["samples"]) > 0 for r in regions if r["view"] == "motion")


@pytest.mark.nightly
def test_an_effect_of_the_users_own_is_ranked_beside_ours(
    study: str, told: Told, tmp_path: Path
) -> None:
    own = tmp_path / "mine.toml"
    own.write_text(
        """
[effects.my_friction]
port = "force"
expression = "-F*v/sqrt(v**2 + w**2)"
physics = "My own dry friction."
source = "me"
parameters.F = { unit = "{F}", role = "strength" }
parameters.w = { unit = "{v}", role = "constant", value = 1e-3, scale = "v" }
"""
    )
    code, _ = told("add", study, "--effect-file", str(own))
    assert code == 0
    _, found = told("explain", study)
    best = found["ranking"][0]
    others = set(best["class"]) | {f"{best['effect']}@{best['port']}"}
    assert {"my_friction@load", "coulomb@load"} <= others
    code, change = told("add", study, "my_friction")
    assert code == 0
    assert change["after"]["held_out_error"] == pytest.approx(4.08, abs=0.02)


MISTAKES = [
    (["strebeck"], "did you mean 'stribeck'?"),
    (["coulomb", "--port", "lod"], "did you mean 'load'?"),
    (
        ["coulomb", "--port", "force_sensor"],
        "not compatible with port 'force_sensor', expected load",
    ),
    (["gap_of_doom"], "found no effect 'gap_of_doom'"),
]


@pytest.mark.parametrize(("arguments", "said"), MISTAKES, ids=[m[0][-1] for m in MISTAKES])
def test_what_is_unknown_is_named_with_near_matches(
    study: str, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    before = (Path(study) / "study.toml").read_bytes()
    assert main(["add", study, *arguments]) == 2
    assert said in capsys.readouterr().err
    assert (Path(study) / "study.toml").read_bytes() == before


BROKEN = [
    ('"-F*v/w*("', "breaks off"),
    ('"-F*y"', "unknown name 'y'"),
    ('"-F*v"', "expected kg m s^-2"),
]


@pytest.mark.parametrize(("expression", "said"), BROKEN, ids=[b[1] for b in BROKEN])
def test_a_wrong_effect_file_is_refused_and_nothing_is_lost(
    study: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], expression: str, said: str
) -> None:
    own = tmp_path / "mine.toml"
    own.write_text(
        f'[effects.mine]\nport = "force"\nexpression = {expression}\nphysics = "p"\n'
        'source = "s"\nparameters.F = { unit = "{F}", role = "strength" }\n'
        'parameters.w = { unit = "{v}", role = "constant", value = 1.0 }\n'
    )
    before = (Path(study) / "study.toml").read_bytes()
    assert main(["add", study, "--effect-file", str(own)]) == 2
    assert said in capsys.readouterr().err
    assert (Path(study) / "study.toml").read_bytes() == before


def test_data_that_changed_are_refused_until_accepted(
    emps: Path, tmp_path: Path, told: Told, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("emps.mcap", "emps_pulses.mcap"):
        (tmp_path / name).write_bytes((emps / name).read_bytes())
    folder, template = str(tmp_path / "study"), str(CONFIGS / "studies" / "emps.toml")
    told("study", "new", folder, "--template", template, "--sessions", str(tmp_path))
    (tmp_path / "emps.mcap").write_bytes((emps / "emps_pulses.mcap").read_bytes())
    capsys.readouterr()
    assert main(["compare", folder]) == 2
    assert "has changed since the last step" in capsys.readouterr().err
    assert told("study", "accept-data", folder)[0] == 0
    assert told("compare", folder)[0] == 0


def test_an_installed_package_offers_effects(
    study: str, tmp_path: Path, told: Told, monkeypatch: pytest.MonkeyPatch
) -> None:
    info = tmp_path / "site" / "offers-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: offers\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[rigwatch.effects]\nmine = offered_effects:effects\n")
    (tmp_path / "site" / "offered_effects.py").write_text(
        "from rigwatch.physics.engine.equations import Effect, EffectParameter\n"
        "def effects():\n"
        "    strength = EffectParameter(unit='{F}', role='strength')\n"
        "    return {'offered': Effect(port='force', expression='-F*sign(v)', physics='Mine.',\n"
        "                              source='me', parameters={'F': strength})}\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    code, change = told("add", study, "offered")
    assert code == 0
    assert change["after"]["held_out_error"] == pytest.approx(4.08, abs=0.02)

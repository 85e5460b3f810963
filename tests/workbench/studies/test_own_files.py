"""Own effect and model files are written with the study and its ledger, all of them or none."""

import contextlib
from pathlib import Path

import pytest

from rigwatch.physics.engine.equations.model import model_text, shipped_models
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.workbench.catalogue.drafts import draft_of_effects, draft_of_model
from rigwatch.workbench.steps.change import learn_text, remodel
from rigwatch.workbench.study.edits import append_effect, use_effect_file
from rigwatch.workbench.study.folder import FILE, LEDGER
from rigwatch.workbench.study.ledger import commit, lines
from rigwatch.workbench.study.study import Study, open_study
from rigwatch.workbench.study.study_file import Accepted
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

OWN = """
[effects.drag]
port = "force"
expression = "k*x*abs(x)"
physics = "Turbulent drag."
source = "a test"
[effects.drag.parameters.k]
unit = "{F}/({x})^2"
role = "strength"
"""
NAME = "own.toml"


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return studied(tmp_path, WAVES, [waves(0)], [waves(1)], UNITS)


def files(study: Study) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in study.folder.iterdir() if p.is_file()}


def test_an_own_effect_is_in_the_study_and_in_its_ledger(study: Study) -> None:
    changed, names = learn_text(study, NAME, OWN)
    assert names == ["drag"]
    assert "drag" in changed.own
    line = list(lines(changed))[-1]
    assert (line["step"], line["file"], line["names"]) == ("effect-file", NAME, ["drag"])
    assert (study.folder / NAME).read_text() == OWN
    again, _ = learn_text(changed, NAME, OWN.replace("Turbulent", "Square"))
    assert again.effect("drag").physics == "Square drag."
    assert again.file.effect_files == (NAME,)


@pytest.mark.parametrize("text", [OWN.replace("k*x*abs(x)", "k*w"), OWN.replace("{F}", "bananas")])
def test_what_is_wrong_changes_nothing(study: Study, text: str) -> None:
    before = files(study)
    with pytest.raises((ModelError, ConfigError)):
        learn_text(study, NAME, text)
    assert files(study) == before


@pytest.mark.parametrize("name", [FILE, "../own.toml", "own.txt", "a/own.toml"])
def test_a_file_has_a_plain_name(study: Study, name: str) -> None:
    with pytest.raises(ModelError, match="expected a name such as"):
        learn_text(study, name, OWN)


@pytest.mark.parametrize("dies_after", range(6))
def test_a_kill_leaves_all_files_or_none(
    study: Study, monkeypatch: pytest.MonkeyPatch, dies_after: int
) -> None:
    """Every write and every replacement of a change, cut off one after the other."""

    class Killed(BaseException):
        pass

    left = [dies_after]

    def until(act: object) -> object:
        def done(*given: object, **more: object) -> object:
            left[0] -= 1
            if left[0] < 0:
                raise Killed
            return act(*given, **more)  # type: ignore[operator]

        return done

    changed = use_effect_file(study, NAME, OWN)
    monkeypatch.setattr("rigwatch.wire.host.whole_file.os.fsync", until(lambda _: None))
    monkeypatch.setattr("rigwatch.workbench.study.folder.os.write", until(_whole_write))
    monkeypatch.setattr(Path, "replace", until(Path.replace))
    with contextlib.suppress(Killed):
        commit(study, changed, "effect-file", file=NAME)
    monkeypatch.undo()
    again = open_study(study.folder)
    written = list(lines(again))[-1]["step"] == "effect-file"
    assert (study.folder / NAME).exists() == written
    assert again.file.effect_files == ((NAME,) if written else ())
    assert not list(study.folder.glob("*.new"))


def _whole_write(descriptor: int, line: bytes) -> int:
    import os

    with os.fdopen(os.dup(descriptor), "ab") as file:
        return file.write(line)


def test_a_file_that_was_changed_meanwhile_is_not_overwritten(study: Study) -> None:
    changed, _ = learn_text(study, NAME, OWN)
    tried = append_effect(
        changed, Accepted(effect="constant_force", port="load", parameters={"F0": 1.0})
    )
    learn_text(open_study(study.folder), NAME, OWN.replace("Turbulent", "Square"))
    before = files(study)
    with pytest.raises(ModelError, match="changed since this step was tried"):
        commit(changed, tried, "add")
    assert files(study) == before


def test_an_effect_in_the_model_keeps_its_declaration(study: Study) -> None:
    changed, _ = learn_text(study, NAME, OWN)
    accepted = append_effect(changed, Accepted(effect="drag", port="load", parameters={"k": 1.0}))
    commit(changed, accepted, "add")
    with pytest.raises(ModelError, match="expected another name"):
        learn_text(open_study(study.folder), NAME, OWN.replace("abs(x)", "x"))
    told = learn_text(open_study(study.folder), NAME, OWN + OWN.replace("drag", "other"))[1]
    assert told == ["drag", "other"]


def test_an_own_model_takes_the_place_of_the_studys(study: Study) -> None:
    text = (study.folder / study.file.model).read_text()
    new = text.replace("summary = ", "summary = 'Own: ' #", 1)
    changed = remodel(study, "mine.toml", new)
    assert changed.file.model == "mine.toml"
    assert list(lines(changed))[-1]["step"] == "model-file"
    commit(
        changed,
        append_effect(changed, Accepted(effect="constant_force", port="load")),
        "add",
    )
    before = (study.folder / FILE).read_bytes(), (study.folder / LEDGER).read_bytes()
    with pytest.raises(ModelError, match="expected a study without effects"):
        remodel(open_study(study.folder), "mine.toml", text)
    assert ((study.folder / FILE).read_bytes(), (study.folder / LEDGER).read_bytes()) == before


SLIPS = {
    "an unknown name": ("k*x*abs(x)", "k*x*abs(w)", 4, 23),
    "broken off": ("k*x*abs(x)", "k*x*(x", 4, 19),
    "a wrong unit": ('expression = "k*x*abs(x)"', 'expression = "k*x"', 4, 15),
    "an unknown unit": ("{F}/({x})^2", "Nss", 8, 1),
    "an unknown key": ("source", "sauce", 6, 1),
    "no TOML": ('port = "force"', 'port = "force', 3, 14),
}


@pytest.mark.parametrize(("good", "bad", "line", "column"), SLIPS.values(), ids=SLIPS)
def test_a_slip_is_found_where_it_is(good: str, bad: str, line: int, column: int) -> None:
    model = shipped_models()["emps-force"]
    assert draft_of_effects(OWN, NAME, model).usable
    found = draft_of_effects(OWN.replace(good, bad, 1), NAME, model)
    assert not found.usable
    assert (found.problems[0].line, found.problems[0].column) == (line, column), found.problems


def test_a_models_findings_stand_at_their_tables() -> None:
    text = model_text("mass-spring-damper")
    assert draft_of_model(text, NAME).usable
    idle = '\n[parameters.idle]\nvalue = 1.0\nunit = "N"\n'
    found = draft_of_model(text + idle, NAME)
    assert not found.usable
    assert [text.count("\n") + 2] == [one.line for one in found.problems if one.severe]
    assert found.drawn["mass-spring-damper"]
    misnamed = text.replace("variables.v =", "variables.velocity =")
    (problem,) = [one for one in draft_of_model(misnamed, NAME).problems if "library" in one.text]
    assert not problem.severe
    assert misnamed.splitlines()[problem.line - 1] == "[ports.load]"

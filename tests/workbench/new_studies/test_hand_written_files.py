"""A study's file that people have written in their own way keeps what they wrote."""

from pathlib import Path

import pytest

from rigwatch.wire.errors import ModelError, SessionError
from rigwatch.workbench.steps.change import learn_text
from rigwatch.workbench.study import creation
from rigwatch.workbench.study.edits import append_effect, drop_effect
from rigwatch.workbench.study.folder import FILE, LEDGER
from rigwatch.workbench.study.study import Study, open_study, study_of
from rigwatch.workbench.study.study_file import Accepted
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied
from tests.workbench.studies.test_own_files import NAME, OWN

LOAD = Accepted(effect="constant_force", port="load", parameters={"offset": 0.5})


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return studied(tmp_path, WAVES, [waves(0)], [waves(1)], UNITS)


def test_undo_leaves_what_stands_behind_the_effect(study: Study) -> None:
    healthy = '# before it was repaired\n[[healthy]]\nsession = "../held_out0.mcap"\n'
    with_effect = append_effect(study, LOAD)
    written = study_of(study.folder, f"{with_effect.text}\n{healthy}")
    undone = drop_effect(written)
    assert not undone.file.effects
    assert [span.session for span in undone.file.healthy] == ["../held_out0.mcap"]
    assert undone.text == f"{study.text.rstrip()}\n\n{healthy}"
    assert drop_effect(with_effect).text == study.text.rstrip() + "\n"


def test_undo_finds_the_last_effect_however_its_table_is_written(study: Study) -> None:
    twice = append_effect(append_effect(study, LOAD), LOAD)
    head, _, table = twice.text.rpartition("[[effects]]")
    own = f"{head}[[ effects ]]  # mine{table}"
    once = drop_effect(study_of(study.folder, own))
    assert [effect.effect for effect in once.file.effects] == ["constant_force"]
    parted = own.replace("parameters = { offset = 0.5 }", "[effects.parameters]\noffset = 0.5")
    assert drop_effect(study_of(study.folder, parted)).text.count("offset") == 1


def test_effects_in_one_list_are_not_undone(study: Study) -> None:
    text = f'effects = [{{ effect = "constant_force", port = "load" }}]\n{study.text}'
    with pytest.raises(ModelError, match=r"in a table \[\[effects\]\] of its own"):
        drop_effect(study_of(study.folder, text))


def test_a_list_over_several_lines_is_replaced_as_a_whole(study: Study) -> None:
    first, _ = learn_text(study, NAME, OWN)
    lines = f'effect_files = [\n  "{NAME}",  # ] what "drag" is\n]  # own\n'
    text = first.text.replace(f'effect_files = ["{NAME}"]\n', lines)
    assert text != first.text
    (study.folder / FILE).write_text(text)
    other = OWN.replace("drag", "drag2")
    second, names = learn_text(open_study(study.folder), "second.toml", other)
    assert (names, second.file.effect_files) == (["drag2"], (NAME, "second.toml"))


def test_a_study_that_another_process_has_just_made_stays(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two make a study of one name at once: both have found the folder empty."""
    monkeypatch.setattr(creation, "check_new", lambda _: None)
    before = {name: (study.folder / name).read_bytes() for name in (FILE, LEDGER)}
    with pytest.raises(SessionError, match="exists already"):
        creation.start_study(study.folder, study.text)
    assert {name: (study.folder / name).read_bytes() for name in (FILE, LEDGER)} == before

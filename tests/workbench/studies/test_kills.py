"""Whenever a process that changes a study is killed, its file and its ledger agree."""

import multiprocessing
import os
import random
import time
from pathlib import Path

import pytest

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.study.edits import append_effect, drop_effect
from rigwatch.workbench.study.folder import FILE, LEDGER, NEW, digest
from rigwatch.workbench.study.ledger import append, commit, lines
from rigwatch.workbench.study.study import Study, open_study
from rigwatch.workbench.study.study_file import Accepted
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

EFFECT = Accepted(effect="constant_force", port="load", parameters={"F0": 1.0})
FORK = multiprocessing.get_context("fork")
KILLS = 20


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return studied(tmp_path, WAVES, [waves(0)], [waves(1)], UNITS)


def change_for_ever(folder: Path, done: Path) -> None:
    """Add and undo, and note each step that was ended."""
    study, number = open_study(folder), 0
    other = drop_effect(study) if study.file.effects else append_effect(study, EFFECT)
    with done.open("ab", buffering=0) as file:
        while True:
            commit(study, other, "add" if other.file.effects else "undo", number=number)
            file.write(b"*")
            study, other, number = other, study, number + 1


def agree(study: Study) -> bool:
    last = list(lines(study))[-1]
    effects = [f"{a.effect}@{a.port}" for a in study.file.effects]
    written = (study.folder / FILE).read_text(encoding="utf-8")
    told = last.get("study", digest(written))
    return bool(told == digest(written) and last["effects"] == effects)


def test_a_kill_at_any_moment_loses_nothing(study: Study, tmp_path: Path) -> None:
    moments, whole = random.Random(1), 0
    for run in range(KILLS):
        done = tmp_path / f"done{run}"
        begun = len(list(lines(study)))
        process = FORK.Process(target=change_for_ever, args=(study.folder, done))
        process.start()
        while not (done.exists() and done.stat().st_size):
            assert process.is_alive()
            time.sleep(0.001)
        time.sleep(moments.uniform(0, 0.01))
        process.kill()
        process.join()
        again = open_study(study.folder)
        assert agree(again)
        assert not (study.folder / NEW).exists()
        steps = list(lines(again))[begun:]
        ended = len(done.read_bytes())
        assert [line["number"] for line in steps] == list(range(len(steps)))
        assert len(steps) in (ended, ended + 1)
        whole += len(steps)
    assert whole > KILLS


@pytest.mark.parametrize("dies_in", ["before the ledger", "after the ledger"])
def test_a_change_that_was_cut_off_is_ended_or_dropped(
    study: Study, monkeypatch: pytest.MonkeyPatch, dies_in: str
) -> None:
    class Killed(BaseException):
        pass

    def dies(*_: object) -> None:
        raise Killed

    changed = append_effect(study, EFFECT)
    if dies_in == "before the ledger":
        monkeypatch.setattr("rigwatch.workbench.study.folder.os.write", dies)
    else:
        monkeypatch.setattr("rigwatch.workbench.study.folder.os.fsync", Dying(2, dies))
    with pytest.raises(Killed):
        commit(study, changed, "add")
    monkeypatch.undo()
    assert (study.folder / NEW).exists()
    again = open_study(study.folder)
    assert agree(again)
    assert len(again.file.effects) == (0 if dies_in == "before the ledger" else 1)


class Dying:
    """A function that dies at its n-th call."""

    def __init__(self, at: int, dies: object) -> None:
        self.at, self.dies = at, dies

    def __call__(self, descriptor: int) -> None:
        self.at -= 1
        if not self.at:
            assert callable(self.dies)
            self.dies()


def test_a_line_that_broke_off_does_not_spoil_the_next(study: Study) -> None:
    with (study.folder / LEDGER).open("ab") as file:
        file.write(b'{"step": "ad')
    append(open_study(study.folder), "accept-data")
    assert [line["step"] for line in lines(study)] == ["new", "accept-data"]


def test_a_step_that_was_tried_on_another_study_is_refused(study: Study) -> None:
    mine, other = open_study(study.folder), open_study(study.folder)
    commit(other, append_effect(other, EFFECT), "add")
    before = (study.folder / FILE).read_bytes(), (study.folder / LEDGER).read_bytes()
    with pytest.raises(ModelError, match="changed since this step"):
        commit(mine, append_effect(mine, EFFECT), "add")
    assert ((study.folder / FILE).read_bytes(), (study.folder / LEDGER).read_bytes()) == before


def test_no_step_is_lost_where_several_append_at_once(study: Study) -> None:
    def work() -> None:
        for _ in range(20):
            append(open_study(study.folder), "accept-data", process=os.getpid())

    several = [FORK.Process(target=work) for _ in range(3)]
    for process in several:
        process.start()
    for process in several:
        process.join()
    assert len(list(lines(study))) == 1 + 3 * 20

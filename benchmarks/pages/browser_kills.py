"""Kill -9 at random moments of add and undo: study and ledger agree, and nothing is lost."""

import json
import multiprocessing
import random
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from rigwatch.workbench.study import Study, append_effect, commit, drop_effect, open_study
from rigwatch.workbench.study.study_file import Accepted
from tools.benchmark_table import Row

KILLS = 200


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    count = KILLS // 10 if quick else KILLS
    root = Path(tempfile.mkdtemp(prefix="rigwatch-kills-"))
    try:
        study = _study(root)
        return [_through_the_server(root, study.folder.name, count), _while_writing(study, count)]
    finally:
        shutil.rmtree(root, ignore_errors=True)


def _study(root: Path) -> Study:
    """A small study, whose steps take a second."""
    from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
    from tests.workbench.machine import studied

    return studied(root, WAVES, [waves(0)], [waves(1)], UNITS)


def _through_the_server(root: Path, name: str, count: int) -> Row:
    from tests.browser.kills import Kills

    kills = Kills(root, name, random.Random(3))
    kills.run(count)
    note = f"every fourth of the server, the others of the study's process; {kills.steps} steps"
    return Row(
        f"kill -9 of server or worker at {count} moments of add and undo",
        f"{len(kills.wrong)} disagree or lose", "0", "", f"{note} were written", not kills.wrong,
    )  # fmt: skip


def _while_writing(study: Study, count: int) -> Row:
    """A process that writes steps without pause is killed: most kills hit the writing itself."""
    effect = Accepted(effect="constant_force", port="load", parameters={})
    moments, lost, steps = random.Random(1), 0, 0
    context = multiprocessing.get_context("fork")
    for number in range(count):
        done = study.folder / f"done{number}"
        begun = len(_ledger(study))
        process = context.Process(target=_change_for_ever, args=(study.folder, done, effect))
        process.start()
        while not (done.exists() and done.stat().st_size):
            time.sleep(0.001)
        time.sleep(moments.uniform(0, 0.02))
        process.kill()
        process.join()
        again = open_study(study.folder)
        whole, ended = _ledger(again)[begun:], len(done.read_bytes())
        agree = whole[-1]["effects"] == [f"{a.effect}@{a.port}" for a in again.file.effects]
        lost += not (agree and ended <= len(whole) <= ended + 1)
        steps += len(whole)
    return Row(
        f"kill -9 at {count} moments of writing", f"{lost} disagree or lose", "0", "",
        f"{steps} steps written by processes that were killed", lost == 0,
    )  # fmt: skip


def _ledger(study: Study) -> list[dict[str, Any]]:
    return [json.loads(line) for line in study.ledger.read_bytes().splitlines()]


def _change_for_ever(folder: Path, done: Path, effect: Accepted) -> None:
    study = open_study(folder)
    other = drop_effect(study) if study.file.effects else append_effect(study, effect)
    with done.open("ab", buffering=0) as file:
        while True:
            commit(study, other, "add" if other.file.effects else "undo")
            file.write(b"*")
            study, other = other, study

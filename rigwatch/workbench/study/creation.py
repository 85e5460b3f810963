"""Creates a study: its file, and the first line of its ledger."""

import os
from pathlib import Path

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.new_file import write_new
from rigwatch.wire.typed_files import load
from rigwatch.workbench.study.folder import FILE, LEDGER
from rigwatch.workbench.study.ledger import append
from rigwatch.workbench.study.study import Study, open_study
from rigwatch.workbench.study.study_file import StudyFile


def check_new(folder: Path) -> None:
    """Check that a folder holds no study, nor the ledger of one.

    Raises:
        ConfigError: it does.
    """
    for name, what in ((FILE, "a study"), (LEDGER, "the ledger of a study")):
        if (folder / name).exists():
            raise ConfigError(folder / name, "", what, "a folder without one: take another")


def start_study(folder: Path, text: str) -> Study:
    """Write the file and the ledger of a new study; an invalid study leaves neither.

    Args:
        folder: created if it does not exist.
        text: the study's file.

    Raises:
        ConfigError: the folder holds a study already.
        RigwatchError: the text, the model, an effect or a recording is invalid.
    """
    check_new(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_new(folder / FILE, text)  # refused if another process was faster: the study is its own
    try:
        study = open_study(folder)
        append(study, "new")
    except BaseException:
        for name in (FILE, LEDGER):
            (folder / name).unlink(missing_ok=True)
        raise
    return study


def create(folder: Path | str, template: Path | str, sessions: Path | str | None = None) -> Study:
    """Create a study in `folder` from the study file `template`.

    Args:
        folder: created if it does not exist.
        template: its comments are kept.
        sessions: folder of the template's sessions; the template's own folder if None.

    Raises:
        ConfigError: the folder holds a study already, the template is invalid, or a session or
            effect file that it names is missing.
    """
    folder, template = Path(folder), Path(template)
    check_new(folder)
    file = load(template, StudyFile)
    recordings = template.parent if sessions is None else Path(sessions)
    text = template.read_text(encoding="utf-8")
    spans = {span.session: recordings for span in (*file.train, *file.held_out, *file.healthy)}
    files = spans | dict.fromkeys(file.effect_files, template.parent)
    if file.model.endswith(".toml"):
        files[file.model] = template.parent
    for name, where in files.items():
        path = where / name
        if not path.exists():
            told = "; --sessions names the recordings' folder" if name in spans else ""
            expected = f"a file of this name in {where}{told}"
            raise ConfigError(template, name, "no such file", expected)
        from_study = os.path.relpath(path.resolve(), folder.resolve())
        text = text.replace(f'"{name}"', f'"{Path(from_study).as_posix()}"')
    return start_study(folder, text)

"""Studies as units of work: found in folders, identified by all that a result depends on."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rigwatch.commands.common.batch_options import add_many, run_many, the_one


def add_studies(parser: argparse.ArgumentParser) -> None:
    """The argument `study`: one or more of them."""
    add_many(parser, "study", "the study's folder")


def the_study(arguments: argparse.Namespace) -> Path | None:
    """The only study given, to be treated by itself; None for work over several."""
    return the_one(arguments, arguments.study, studies_in)


def run_studies(
    arguments: argparse.Namespace,
    name: str,
    call: Callable[..., Any],
    line: Callable[[Any], str],
    **settings: Any,
) -> int:
    """Run a job over the studies; 0 if each has a result, else 1."""
    from rigwatch.batch import Job

    job = Job(name, call, study_content)
    return run_many(arguments, arguments.study, job, settings, line=line, inside=studies_in)


def studies_in(folder: Path) -> list[Path]:
    """The studies in a folder, at any depth; itself, if it is one."""
    from rigwatch.workbench.study import FILE

    if (folder / FILE).is_file():
        return [folder]
    return sorted(file.parent for file in folder.rglob(FILE))


def study_content(folder: Path) -> str:
    """Hash of the study's file, model, effects and recordings."""
    from rigwatch.workbench.study import open_study, stands_on

    return stands_on(open_study(folder))

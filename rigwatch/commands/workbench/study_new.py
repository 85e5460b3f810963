"""`rigwatch study new`: makes a study after a template."""

import argparse
from pathlib import Path

from rigwatch.commands.common import file_or_name, print_json

HELP = "make a study of a model and recordings, after a template"
EXAMPLE = "  rigwatch study new emps --template emps --sessions recordings/"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument(
        "--template",
        type=file_or_name("studies"),
        required=True,
        metavar="TOML",
        help="study file to start from, or the name of one that comes with rigwatch",
    )
    parser.add_argument(
        "--sessions", type=Path, metavar="FOLDER", help="where the template's sessions are"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 when it was made."""
    from rigwatch.workbench.study import create, ledger

    study = create(arguments.study, arguments.template, arguments.sessions)
    line = ledger.append(study, "new")
    if arguments.json:
        print_json(line)
        return 0
    print(f"{study.folder}: model {study.model.name}: {study.model.summary}")
    print(f"  {len(study.effects)} effects may be tried; next: rigwatch explain {study.folder}")
    return 0

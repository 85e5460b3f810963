"""`rigwatch study new`: makes a study of logs and a model, or from a template."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import add_log_columns, file_or_name, print_json, say

if TYPE_CHECKING:
    from rigwatch.workbench.steps import Logs

HELP = "make a study of logs and a model, or from a template"
EXAMPLE = """\
  rigwatch study new drive --data run1.csv run2.csv --model motor --set R=2.0 --set K=0.06
  rigwatch study new drive --data a.csv b.csv --model motor --set a:J=2e-4 --set b:J=5e-4
  rigwatch study new drive --data log.csv --model motor --map 'speed=n[rpm]' --time 't[ms]'
  rigwatch study new emps --template emps --sessions recordings/"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")
    given = parser.add_mutually_exclusive_group(required=True)
    given.add_argument(
        "--data", type=Path, nargs="+", metavar="LOG", help="logs of the machine: CSV, MAT, …"
    )
    given.add_argument(
        "--template",
        type=file_or_name("studies"),
        metavar="TOML",
        help="study file to start from, or the name of a shipped one",
    )
    parser.add_argument(
        "--sessions", type=Path, metavar="FOLDER", help="folder of the template's sessions"
    )
    parser.add_argument("--model", help="a shipped model's name, or a model file, for --data")
    parser.add_argument(
        "--healthy", type=Path, nargs="+", default=[], metavar="LOG", help="logs with nothing wrong"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="[LOG:]NAME=VALUE",
        help="a parameter of the model that you know, in its unit; of one log alone if it is named",
    )
    add_log_columns(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if it is written."""
    from rigwatch.workbench.steps import study_from_logs
    from rigwatch.workbench.study import create, ledger

    remarks: list[str] = []
    if arguments.data:
        study, remarks = study_from_logs(arguments.study, _logs(arguments))
    else:
        study = create(arguments.study, arguments.template, arguments.sessions)
    if arguments.json:
        *_, line = ledger.lines(study)
        print_json(line | {"remarks": remarks})
        return 0
    print(f"{study.folder}: model {study.model.name}: {study.model.summary}")
    for remark in remarks:
        say(remark)
    print(f"  {len(study.effects)} effects may be tried; next: rigwatch explain {study.folder}")
    return 0


def _logs(arguments: argparse.Namespace) -> "Logs":
    """The logs described by the options."""
    from rigwatch.wire.errors import ModelError
    from rigwatch.wire.exchange import ImportMapping, parse_map_option
    from rigwatch.workbench.steps import Logs

    if not arguments.model:
        raise ModelError("--data: found no --model, expected a model's name or file")
    columns = tuple(arguments.columns.split(",")) if arguments.columns else ()
    mapping = ImportMapping(
        channels=dict(map(parse_map_option, arguments.map)),
        time=arguments.time or "",
        rate=arguments.rate,
        columns=columns,
    )
    return Logs(
        tuple(arguments.data),
        arguments.model,
        tuple(arguments.healthy),
        mapping,
        *_known(arguments.set),
    )


def _known(given: list[str]) -> tuple[dict[str, float], dict[str, dict[str, float]]]:
    """Known parameters of all logs, and of single ones by the log's name."""
    start: dict[str, float] = {}
    of_log: dict[str, dict[str, float]] = {}
    for text in given:
        log, name, value = _value(text)
        (of_log.setdefault(log, {}) if log else start)[name] = value
    return start, of_log


def _value(text: str) -> tuple[str, str, float]:
    """A log or "", a parameter and its value.

    Raises:
        ModelError: the text is not NAME=VALUE or LOG:NAME=VALUE.
    """
    from rigwatch.wire.errors import ModelError

    name, _, value = text.partition("=")
    log, _, name = name.rpartition(":")
    try:
        return log.strip(), name.strip(), float(value)
    except ValueError:
        raise ModelError(f"--set: found {text!r}, expected NAME=VALUE such as R=2.0") from None

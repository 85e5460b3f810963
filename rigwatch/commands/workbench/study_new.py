"""`rigwatch study new`: makes a study of logs and a model, or from a template."""

import argparse
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import (
    add_log_columns,
    ask_for_logs,
    can_ask,
    file_or_name,
    hint_of_unit,
    number_in_unit,
    print_json,
    say,
)

if TYPE_CHECKING:
    from rigwatch.workbench.steps import Logs

_NUMBER = re.compile(r"[A-Za-z_][\w.]*(\s*\[[^\]]+\])?")
HELP = "create a study from logs and a model, or from a template"
EXAMPLE = """\
  rigwatch study new drive
  rigwatch study new drive --data run1.csv run2.csv --model motor --set R=2.0 --set K=0.06
  rigwatch study new drive --data a.csv b.csv --model motor --set a:J=2e-4 --set b:J=5e-4
  rigwatch study new servo --data *.json --model servo.toml --set kp=kp --set m=mass[kg]
  rigwatch study new drive --data log.csv --model motor --map 'speed=n[rpm]' --time 't[ms]'
  rigwatch study new emps --template emps --sessions recordings/"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")
    given = parser.add_mutually_exclusive_group()
    given.add_argument(
        "--data",
        type=Path,
        nargs="+",
        metavar="LOG",
        help="logs of the machine: CSV, MAT, …; without --data and --template a terminal is asked",
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
        "--healthy",
        type=Path,
        nargs="+",
        default=[],
        metavar="LOG",
        help="logs of the healthy machine",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="[LOG:]NAME=VALUE",
        help="a parameter of the model that you know, in its unit or one in brackets such as"
        " m=141[g]; of one log alone if it is named; or the name of a number that each log states"
        " beside its columns, such as m=mass[g]",
    )
    add_log_columns(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if it is written."""
    from rigwatch.workbench.ranking import suitable
    from rigwatch.workbench.steps import study_from_logs
    from rigwatch.workbench.study import create, ledger

    remarks: list[str] = []
    if not arguments.data and not arguments.template:
        _ask(arguments)
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
    tried, elective = suitable(study)
    print(f"  {_effects(len(tried), len(elective))}")
    print(f"next: rigwatch explain {study.folder}")
    return 0


def _effects(usual: int, rarer: int) -> str:
    """How many effects suit the model's ports, and when the rarer ones are tried."""
    if not rarer:
        return f"{usual} effects suit its ports"
    tried = f"{usual} are tried at once, {rarer} rarer ones if none of those explains the error"
    return f"{usual + rarer} effects suit its ports: {tried}"


def _ask(arguments: argparse.Namespace) -> None:
    """Ask for logs, model and columns.

    Raises:
        ModelError: nobody can be asked.
    """
    from rigwatch.wire.errors import ModelError
    from rigwatch.workbench.study import check_new

    if not can_ask():
        raise ModelError("found neither --data nor --template, expected one of them")
    check_new(arguments.study)
    ask_for_logs(arguments)


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
    known = _known(arguments.set, arguments.model) if arguments.set else _Known()
    return Logs(
        tuple(arguments.data),
        arguments.model,
        tuple(arguments.healthy),
        mapping,
        known.start,
        known.of_log,
        known.stated,
    )


@dataclass
class _Known:
    """Values of `--set`.

    Attributes:
        start: of all logs, by parameter.
        of_log: by the log's name and parameter.
        stated: parameter = "number" or "number[unit]" that each log states.
    """

    start: dict[str, float] = field(default_factory=dict)
    of_log: dict[str, dict[str, float]] = field(default_factory=dict)
    stated: dict[str, str] = field(default_factory=dict)


def _known(given: list[str], model: str) -> "_Known":
    """The values of `--set`, in the units of the model.

    Raises:
        ModelError: a text is not NAME=VALUE, LOG:NAME=VALUE or NAME=NUMBER[UNIT], or a unit is not
            of the parameter's kind.
    """
    from rigwatch.physics.engine.equations import model_named
    from rigwatch.wire.errors import ModelError

    known, parameters = _Known(), model_named(model).parameters
    units = {name: parameter.shown or parameter.unit for name, parameter in parameters.items()}
    for text in given:
        name, _, value = (part.strip() for part in text.partition("="))
        log, _, name = (part.strip() for part in name.rpartition(":"))
        number = number_in_unit(f"--set {text}", name, value, units)
        if number is not None:
            (known.of_log.setdefault(log, {}) if log else known.start)[name] = number
        elif log or not _NUMBER.fullmatch(value):
            expected = "NAME=VALUE such as R=2.0, or the name of a number that each log states"
            raise ModelError(f"--set: found {text!r}, expected {expected}{hint_of_unit(text)}")
        else:
            known.stated[name] = value
    return known

"""Asks on a terminal for what `rigwatch study new` needs: logs, model and columns.

Each question shows in brackets what Enter takes. At the end stands the command that asks nothing.
"""

import argparse
import shlex
import sys
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common.output import say
from rigwatch.wire.errors import ModelError

if TYPE_CHECKING:
    from rigwatch.physics.engine.equations import Input, Model, Output

LOGS = (".csv", ".mat", ".parquet", ".json")
"""Suffixes of the files that are taken for logs where a folder is looked through."""


def can_ask() -> bool:
    """Whether a person at a terminal reads questions and answers them."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def ask_for_logs(arguments: argparse.Namespace) -> None:
    """Complete the arguments by the answers.

    Raises:
        ImportDataError: the first log cannot be read.
        ModelError: the input ends, a model is unknown, or no logs are named.
    """
    from rigwatch.physics.engine.equations import model_named, shipped_models
    from rigwatch.wire.exchange import ImportMapping, read_table

    here = sorted(path.name for path in Path().iterdir() if path.suffix in LOGS)
    answer = _answer("logs of the machine, separated by spaces", shlex.join(here))
    try:
        logs = shlex.split(answer)
    except ValueError as error:
        said = "expected names such as run1.csv 'run 2.csv', each quotation closed"
        raise ModelError(f"found {answer!r}, {said}") from error
    if not logs:
        raise ModelError("found no logs, expected files such as run1.csv")
    arguments.data = [Path(log) for log in logs]
    names = arguments.columns.split(",") if arguments.columns else ()
    columns = read_table(arguments.data[0], ImportMapping(columns=tuple(names))).names
    if not arguments.model:
        models = shipped_models()
        say(f"models: {', '.join(sorted(models))}; or a model file")
        arguments.model = _answer("model", _suiting(columns, models))
    model = model_named(arguments.model)
    say(f"columns of {logs[0]}: {', '.join(columns)}")
    given = {text.partition("=")[0].strip() for text in arguments.map}
    arguments.map += _columns(columns, model, given)
    say(f"without questions: {_command(arguments)}")


def _suiting(columns: Iterable[str], models: "Mapping[str, Model]") -> str:
    """The model of the most signals that all have a column; empty if none has."""
    from rigwatch.workbench.steps import suggested

    size = {name: len(model.inputs) + len(model.outputs) for name, model in models.items()}
    whole = [n for n, model in models.items() if len(suggested([*columns], model)) == size[n]]
    return max(whole, key=size.__getitem__, default="")


def _columns(columns: Iterable[str], model: "Model", given: Collection[str]) -> list[str]:
    """Answers as options of `--map`; a signal without an answer is left to be derived."""
    from rigwatch.workbench.steps import suggested

    likely, found = suggested([*columns], model), list[str]()
    signals: dict[str, Input | Output] = {**model.inputs, **model.outputs}
    for name, signal in signals.items():
        channel, unit = signal.channel or name, signal.shown or signal.unit
        if channel in given:
            continue
        column = _answer(f"column of {channel}, in {unit} or COLUMN[UNIT]", likely.get(channel, ""))
        if column:
            found.append(f"{channel}={column}" if "[" in column else f"{channel}={column}[{unit}]")
    return found


def _answer(question: str, usual: str) -> str:
    """What is typed; `usual` if that is nothing.

    Raises:
        ModelError: the input ends.
    """
    print(f"{question} [{usual}]: " if usual else f"{question}: ", end="", file=sys.stderr)
    sys.stderr.flush()
    line = sys.stdin.readline()
    if not line:
        raise ModelError(f"found no answer, expected {question}")
    return line.strip() or usual


def _command(arguments: argparse.Namespace) -> str:
    """The command line of these arguments."""
    words = ["rigwatch", "study", "new", str(arguments.study), "--model", arguments.model]
    words += ["--data", *map(str, arguments.data)]
    words += ["--healthy", *map(str, arguments.healthy)] if arguments.healthy else []
    for option in ("map", "set", "time", "rate", "columns"):
        given = getattr(arguments, option) or []
        for each in given if isinstance(given, list) else [given]:
            words += [f"--{option}", str(each)]
    return shlex.join(words)

"""The command line: one thin module per command, listed in the table below.

A command module has

    HELP: str        one line for `rigwatch --help`
    EXAMPLE: str     at least one line that a user can type, shown by `rigwatch <command> --help`
    def add_arguments(parser: argparse.ArgumentParser) -> None
    def run(arguments: argparse.Namespace) -> int      the exit code, 0 for success

and does slow imports inside `run`. A command with sub-commands has, in place of both functions,

    ACTIONS: dict[str, str]      name of each: its module below rigwatch.commands

and each of these is a command module again. Results go to stdout, progress and remarks to stderr.
Every command has `--json`, added here: `arguments.json` is then true and stdout carries only JSON.
"""

import argparse
import errno
import importlib
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any

from rigwatch.commands.any_text import write_any_text
from rigwatch.commands.unwinding import unwound_at_signal
from rigwatch.version import __version__
from rigwatch.wire.errors import RigwatchError, nearest, reason_of

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

COMMANDS: dict[str, str] = {
    # name on the command line: module below rigwatch.commands
    "demo": "processes.demo",
    "init": "processes.init",
    "up": "processes.up",
    "router": "processes.router",
    "plant": "processes.plant",
    "daq": "processes.daq",
    "monitor": "processes.monitor",
    "record": "processes.record",
    "witness": "processes.witness",
    "commission": "processes.commission",
    "fleet": "processes.fleet",
    "alarms": "alarms.alarms",
    "ack": "alarms.ack",
    "accept": "alarms.accept",
    "keys": "keys.keys",
    "doctor": "processes.doctor",
    "dashboard": "processes.dashboard",
    "view": "sessions.view",
    "archive": "archive.archive",
    "structure": "structures.structure",
    "info": "sessions.info",
    "trim": "sessions.trim",
    "recover": "sessions.recover",
    "replay": "sessions.replay",
    "verify": "sessions.verify",
    "model": "catalogue.model",
    "effects": "catalogue.effects",
    "workbench": "workbench.workbench",
    "study": "workbench.study",
    "compare": "workbench.compare",
    "locate": "workbench.locate",
    "explain": "workbench.explain",
    "add": "workbench.add",
    "undo": "workbench.undo",
    "import": "sessions.import_",
    "export": "sessions.export",
}
"""One row per command; keep the rows sorted by what a newcomer needs first."""

EXIT_ERROR = 2
EXIT_INTERRUPTED = 130
_OUTPUT_LOST = (errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EFBIG)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `rigwatch`; returns the exit code."""
    # The matrices are small: a second thread of the linear algebra would spin, and take the time
    # of the rig's other processes. NumPy reads this when a command first imports it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    write_any_text(sys.stdout, sys.stderr)
    with unwound_at_signal():
        return _run(sys.argv[1:] if argv is None else argv)


def _run(given: Sequence[str]) -> int:
    """Run a command; returns the exit code."""
    try:
        _refuse_undecodable(given)
        _refuse_unknown([word for word in given if not word.startswith("-")], COMMANDS)
        try:
            arguments = _parser(given).parse_args(given)
        except SystemExit:
            sys.stdout.flush()  # the help: a failed write would go unnoticed at exit
            raise
        code = int(arguments.run(arguments))
        sys.stdout.flush()
        return code
    except RigwatchError as error:
        print(f"rigwatch: {error}", file=sys.stderr)
        return EXIT_ERROR
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_ERROR
    except OSError as error:
        if error.filename is not None:
            print(f"rigwatch: {error.filename}: {reason_of(error)}", file=sys.stderr)
            return EXIT_ERROR
        if error.errno not in _OUTPUT_LOST:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"rigwatch: the output cannot be written: {reason_of(error)}", file=sys.stderr)
        return EXIT_ERROR
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


def _refuse_undecodable(given: Sequence[str]) -> None:
    """Names of files stand in files of TOML and JSON, which hold no other bytes than UTF-8."""
    for argument in given:
        if any("\ud800" <= letter <= "\udfff" for letter in argument):
            raise RigwatchError(f"{argument!r}: found bytes that are not UTF-8, expected UTF-8")


def _refuse_unknown(words: Sequence[str], table: Mapping[str, str]) -> None:
    """Name the command that was meant; argparse would list all of them."""
    if not words or not table:
        return
    name, *others = words
    if name not in table:
        raise RigwatchError(f"found command {name!r}{nearest(name, table)}")
    _refuse_unknown(others, _actions(_module(table[name])))


def every_command(
    table: Mapping[str, str] = COMMANDS, above: str = "rigwatch"
) -> Iterator[tuple[str, ModuleType]]:
    """Each command as typed, such as "rigwatch study new", and its module."""
    for name, module_name in table.items():
        module = _module(module_name)
        yield f"{above} {name}", module
        yield from every_command(_actions(module), f"{above} {name}")


class _Parser(argparse.ArgumentParser):
    """Raises when its help cannot be written, which argparse passes over.

    Help and errors write what the user replaces in capitals, as they do for options.
    """

    def add_argument(self, *names: str, **options: Any) -> argparse.Action:
        if not names[0].startswith("-") and "choices" not in options:
            options.setdefault("metavar", names[0].upper())
        return super().add_argument(*names, **options)

    def _print_message(self, message: str, file: "SupportsWrite[str] | None" = None) -> None:
        print(message, end="", file=file or sys.stderr)


def _parser(argv: Sequence[str]) -> argparse.ArgumentParser:
    parser = _Parser(
        prog="rigwatch",
        description="Monitors a test rig against its model and finds what the model lacks.",
    )
    parser.add_argument("--version", action="version", version=f"rigwatch {__version__}")
    parser.set_defaults(json=False)
    _add_commands(parser, "COMMAND", COMMANDS, argv)
    return parser


def _add_commands(
    parser: argparse.ArgumentParser, kind: str, table: Mapping[str, str], argv: Sequence[str]
) -> None:
    added = parser.add_subparsers(metavar=kind, required=True)
    for name, module_name in table.items():
        module = _module(module_name)
        command = added.add_parser(
            name,
            help=module.HELP,
            description=module.HELP,
            epilog=f"example:\n{module.EXAMPLE}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        # Only the requested command is loaded completely, so that the others cost nothing.
        if name in argv:
            _fill(command, module, argv)


def _fill(parser: argparse.ArgumentParser, module: ModuleType, argv: Sequence[str]) -> None:
    """Add the arguments of a command, or its sub-commands."""
    # Valid before or after a sub-command: absence at one place must not undo the other.
    parser.add_argument(
        "--json", action="store_true", default=argparse.SUPPRESS, help="print results as JSON"
    )
    if actions := _actions(module):
        _add_commands(parser, "ACTION", actions, argv)
    else:
        module.add_arguments(parser)
        parser.set_defaults(run=module.run)


def _module(name: str) -> ModuleType:
    return importlib.import_module(f"rigwatch.commands.{name}")


def _actions(module: ModuleType) -> Mapping[str, str]:
    """Modules of a command's sub-commands, by name; empty if it has none."""
    found: Mapping[str, str] = getattr(module, "ACTIONS", {})
    return found

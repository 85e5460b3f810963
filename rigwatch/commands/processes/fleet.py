"""`rigwatch fleet`: the state of many rigs at a glance, the worst first."""

import argparse
import contextlib
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import PORT, check_folder, number, print_json, tell_address
from rigwatch.wire.errors import SessionError, reason_of

if TYPE_CHECKING:
    from rigwatch.fleet import Fleet, RigState

HELP = "show many rigs, the worst first: alarms, missing processes, losses, latency"
EXAMPLE = """\
  rigwatch fleet rigs/*.toml
  rigwatch fleet rigs/*.toml --follow
  rigwatch fleet rigs/*.toml --json
  rigwatch fleet rigs/*.toml --page fleet.html --follow
  rigwatch fleet rigs/*.toml --serve"""
EXIT_UNWELL = 1
_EVERY_S = 2.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    help_ = "configurations of the rigs, on one router or several"
    parser.add_argument("config", type=Path, nargs="+", metavar="CONFIG", help=help_)
    parser.add_argument("--follow", action="store_true", help="repeat every two seconds")
    parser.add_argument(
        "--timeout",
        type=number(0, 3600, above=True),
        default=3.0,
        metavar="S",
        help="maximum wait for a rig, default 3",
    )
    parser.add_argument("--page", type=Path, metavar="FILE.html", help="write a web page instead")
    parser.add_argument("--serve", action="store_true", help="serve a live web page instead")
    parser.add_argument(
        "--port", type=PORT, default=0, help="port of that page; default: a free one"
    )
    parser.add_argument("--open", action="store_true", help="open it in this machine's browser")


def run(arguments: argparse.Namespace) -> int:
    """0 if every rig runs without an alarm, else 1; with --follow until interrupted."""
    from rigwatch.fleet import Fleet

    check_folder(arguments.page)
    fleet = Fleet(arguments.config, arguments.timeout)
    page = _Page(arguments.page, follows=arguments.follow) if arguments.page else None
    try:
        if arguments.serve:
            return _serve(arguments, fleet)
        while True:
            states = fleet.states()
            _show(arguments, states, page)
            if not arguments.follow:
                return EXIT_UNWELL if any(state.rank for state in states) else 0
            time.sleep(_EVERY_S)
    finally:
        fleet.close()


def _serve(arguments: argparse.Namespace, fleet: "Fleet") -> int:
    """0 when it was ended."""
    try:
        from rigwatch.browser.server import Listening, serve_fleet
    except ModuleNotFoundError as error:
        from rigwatch.wire.errors import MissingExtraError

        raise MissingExtraError(
            error.name or "starlette", "workbench", "the live page of many rigs"
        ) from None

    def ready(address: str) -> None:
        tell_address(arguments, address, "all rigs, the worst first")

    serve_fleet(fleet.states, Listening(port=arguments.port), ready)
    return 0


class _Page:
    """The page of all rigs; one that is written again and again outlasts a full disk.

    Args:
        path: its file.
        follows: whether it is written again.
    """

    def __init__(self, path: Path, *, follows: bool) -> None:
        self._path, self._follows, self._why_not = path, follows, ""

    def write(self, states: "list[RigState]") -> None:
        """Write it; what keeps it from being written is told once, and that it has ended.

        Raises:
            SessionError: it cannot be written, and will not be again.
        """
        from rigwatch.fleet import as_page
        from rigwatch.wire.host import replace_file

        try:
            text = as_page(states, every_s=_EVERY_S * self._follows)
            replace_file(self._path, text, durable=False)
        except OSError as error:
            why = f"cannot be written: {reason_of(error)}"
            if not self._follows:
                raise SessionError(f"{self._path}: {why}") from error
            self._tell(why, f"{why}; it is tried again every {_EVERY_S:.0f} s")
        else:
            self._tell("", "is written again")

    def _tell(self, why_not: str, text: str) -> None:
        before, self._why_not = self._why_not, why_not
        if why_not != before:
            with contextlib.suppress(OSError):  # the same disk may hold what is told
                print(f"rigwatch: {self._path}: {text}", file=sys.stderr, flush=True)


def _show(arguments: argparse.Namespace, states: "list[RigState]", page: _Page | None) -> None:
    from rigwatch.fleet import as_lines

    if page is not None:
        page.write(states)
    if arguments.json:
        print_json(states)
    elif page is None:
        clear = "\x1b[2J\x1b[H" if arguments.follow and sys.stdout.isatty() else ""
        print(clear + "\n".join(as_lines(states)), flush=True)

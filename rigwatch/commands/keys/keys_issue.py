"""`rigwatch keys issue`: a certificate for one name."""

import argparse
from pathlib import Path

HELP = "issue a certificate and revoke the previous one of the name"
EXAMPLE = "  rigwatch keys issue keys ann --role operator"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the keys")
    parser.add_argument(
        "name", metavar="NAME", help="name of the process or person, such as daq or ann"
    )
    parser.add_argument("--role", help="role; default: the name itself")
    parser.add_argument(
        "--address", action="append", default=[], help="name or address of the router's machine"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 when it is written."""
    from rigwatch.commands.keys.keys_show import print_register
    from rigwatch.keys import Authority

    authority = Authority(arguments.folder)
    authority.issue(arguments.name, arguments.role or arguments.name, arguments.address)
    print_register(authority.register, arguments.json)
    return 0

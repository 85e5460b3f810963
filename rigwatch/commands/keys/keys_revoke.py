"""`rigwatch keys revoke`: a certificate that is valid no longer."""

import argparse
import sys
from pathlib import Path

HELP = "revoke the certificate of a name"
EXAMPLE = "  rigwatch keys revoke keys ann"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the keys")
    parser.add_argument("name", metavar="NAME", help="name of the process or person")


def run(arguments: argparse.Namespace) -> int:
    """0 when it is revoked."""
    from rigwatch.commands.keys.keys_show import print_register
    from rigwatch.keys import Authority

    authority = Authority(arguments.folder)
    authority.revoke(arguments.name)
    print_register(authority.register, arguments.json)
    print(
        "in force at once where router and monitor read this register; copy it where they read "
        "another",
        file=sys.stderr,
    )
    return 0

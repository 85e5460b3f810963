"""`rigwatch keys new`: an authority, and a certificate for each role."""

import argparse
from pathlib import Path

HELP = "create the authority of a rig and a certificate for each role"
EXAMPLE = "  rigwatch keys new keys --rig bench1 --address 192.168.1.5"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="new folder for the keys")
    parser.add_argument("--rig", required=True, help="the rig's id")
    parser.add_argument(
        "--address",
        action="append",
        default=[],
        help="name or address under which the router is reached; may be repeated",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 when all are written."""
    from rigwatch.commands.keys.keys_show import print_register
    from rigwatch.keys import Authority
    from rigwatch.wire.access import ROLES

    authority = Authority.create(arguments.folder, arguments.rig)
    for role in ROLES:
        authority.issue(role, role, arguments.address if role == "router" else ())
    print_register(authority.register, arguments.json)
    return 0

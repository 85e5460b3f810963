"""`rigwatch keys show`: what the authority of a rig has issued."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigwatch.wire.access import Register

HELP = "show the certificates of a rig"
EXAMPLE = "  rigwatch keys show keys --json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the keys")


def run(arguments: argparse.Namespace) -> int:
    """0 when the register could be read."""
    from rigwatch.keys import Authority

    print_register(Authority(arguments.folder).register, arguments.json)
    return 0


def print_register(register: "Register", as_json: bool) -> None:
    """The certificates, one a line or as JSON."""
    from datetime import UTC, datetime

    import msgspec

    from rigwatch.wire.access import days_left

    if as_json:
        print(msgspec.json.encode(register).decode())
        return
    today = datetime.now(UTC).date()
    for one in register.issued:
        validity = "valid until" if days_left(one, today) >= 0 else "ended on"
        state = "revoked" if one.revoked else f"{validity} {one.ends}"
        print(f"{one.common_name:20} {one.role:10} {state}")

"""`rigwatch witness`: watches the monitor from outside and notifies people."""

import argparse
from pathlib import Path

HELP = "raise an alarm when the monitor stops, and notify people of alarms"
EXAMPLE = "  rigwatch witness configs/demo.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")


def run(arguments: argparse.Namespace) -> int:
    """Witness until a signal ends it."""
    from rigwatch.wire.host import set_at_signal
    from rigwatch.wire.rig_config import load_rig
    from rigwatch.witness import run as witness

    witness(load_rig(arguments.config), set_at_signal())
    return 0

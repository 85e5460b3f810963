"""`rigwatch router`: runs the router of a rig's bus."""

import argparse
from pathlib import Path

HELP = "run the router of a rig's bus"
EXAMPLE = "  rigwatch router configs/demo.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")


def run(arguments: argparse.Namespace) -> int:
    """Route until a signal ends it."""
    from rigwatch.router import run as route
    from rigwatch.wire.host import ROUTER, raise_priority, set_at_signal
    from rigwatch.wire.rig_config import load_rig

    config = load_rig(arguments.config)
    stop = set_at_signal()
    raise_priority(ROUTER)
    route(config, stop)
    return 0

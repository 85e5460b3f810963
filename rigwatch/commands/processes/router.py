"""`rigwatch router`: runs the router of a rig's bus."""

import argparse
from pathlib import Path

HELP = "run the router of a rig's bus"
EXAMPLE = "  rigwatch router configs/demo.toml"
TURN = 0.25
"""Time between two notifications to the supervisor [s]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")


def run(arguments: argparse.Namespace) -> int:
    """Route until a signal ends it."""
    from rigwatch.wire.bus import open_router
    from rigwatch.wire.host import ROUTER, Heartbeat, raise_priority, set_at_signal
    from rigwatch.wire.rig_config import load_rig

    config = load_rig(arguments.config)
    stop = set_at_signal()
    heartbeat = Heartbeat("router")
    raise_priority(ROUTER)
    close = open_router(config)
    heartbeat.ready(f"listens at {config.bus.listen}")
    # Samples do not pass through this loop: it only reports that it runs.
    while not stop.wait(TURN):
        heartbeat.advance(0)
    heartbeat.stopping()
    close()
    return 0

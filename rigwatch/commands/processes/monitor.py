"""`rigwatch monitor`: judges a rig's samples and publishes estimates and alarms."""

import argparse
from pathlib import Path

HELP = "monitor a rig: samples in, friction estimates and alarms out"
EXAMPLE = "  rigwatch monitor configs/demo.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")


def run(arguments: argparse.Namespace) -> int:
    """Monitor until a signal ends it."""
    from monitor.process import run as run_monitor

    return run_monitor(arguments.config)

"""`rigwatch daq`: acquires samples from a device and publishes them."""

import argparse
from pathlib import Path

HELP = "acquire samples from the rig's device and publish them"
EXAMPLE = """  rigwatch daq configs/demo.toml
  rigwatch daq configs/rigs/serial.toml"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")


def run(arguments: argparse.Namespace) -> int:
    """Acquire until a signal ends it."""
    from daq.__main__ import main

    return main(arguments.config)

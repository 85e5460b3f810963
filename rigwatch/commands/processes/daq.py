"""`rigwatch daq`: acquires samples from a device and publishes them."""

import argparse
from pathlib import Path

HELP = "acquire samples from the devices of one or several rigs and publish them"
EXAMPLE = """  rigwatch daq configs/demo.toml
  rigwatch daq configs/rigs/serial.toml
  rigwatch daq rigs/*.toml              # several rigs in one process"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    help_ = "configuration of a rig; several rigs share the process"
    parser.add_argument("config", type=Path, nargs="+", metavar="CONFIG", help=help_)


def run(arguments: argparse.Namespace) -> int:
    """Acquire until a signal ends it."""
    from daq.__main__ import main
    from daq.several import run_several

    if len(arguments.config) == 1:
        return main(arguments.config[0])
    return run_several(arguments.config)

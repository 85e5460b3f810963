"""`rigwatch monitor`: judges a rig's samples and publishes estimates and alarms."""

import argparse
from pathlib import Path

HELP = "monitor one or several rigs: samples in, friction estimates and alarms out"
EXAMPLE = """\
  rigwatch monitor configs/demo.toml
  rigwatch monitor rigs/*.toml          # several rigs in one process"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    help_ = "configuration of a rig; several rigs share the process"
    parser.add_argument("config", type=Path, nargs="+", metavar="CONFIG", help=help_)


def run(arguments: argparse.Namespace) -> int:
    """Monitor until a signal ends it."""
    from rigwatch.wire.several_rigs import valid_rigs

    valid_rigs(arguments.config)  # report a wrong file before kernels load, which takes seconds
    from monitor.process import run as run_monitor
    from monitor.process import run_several

    if len(arguments.config) == 1:
        return run_monitor(arguments.config[0])
    return run_several(arguments.config)

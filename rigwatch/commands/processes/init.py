"""`rigwatch init`: copies the shipped example files into a folder."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_result

HELP = "copy the example configurations, scenarios, studies, mappings and structures"
EXAMPLE = """\
  rigwatch init
  rigwatch init my-rig"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "folder",
        type=Path,
        nargs="?",
        default=Path(),
        help="parent of the new folder `configs`; default: the working folder",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if they are copied; existing files are kept."""
    from rigwatch.wire.typed_files import copy_out

    copied, kept = copy_out(arguments.folder)
    target = arguments.folder / "configs"
    lines = (
        f"{target}: {len(copied)} files copied, {len(kept)} that were there already kept",
        "  next: rigwatch demo, or rigwatch study new STUDY --data LOG --model MODEL",
    )
    print_result(arguments, {"copied": copied, "kept": kept}, lines)
    return 0

"""`rigwatch init`: copies the shipped example files into a folder."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json

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
    if arguments.json:
        print_json({"copied": [str(path) for path in copied], "kept": [str(p) for p in kept]})
        return 0
    target = arguments.folder / "configs"
    print(f"{target}: {len(copied)} files copied, {len(kept)} that were there already kept")
    print("  next: rigwatch demo, or rigwatch study new STUDY --template emps")
    return 0

"""`rigwatch init`: copies the example files that come with rigwatch into a folder."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json

HELP = "copy the example configurations, scenarios, studies, mappings and structures out"
EXAMPLE = """\
  rigwatch init
  rigwatch init my-rig"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "folder", type=Path, nargs="?", default=Path(), help="where `configs` is made; here if none"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 when they were copied; files that are there already stay as they are."""
    from rigwatch.wire.typed_files import copy_out

    copied, kept = copy_out(arguments.folder)
    if arguments.json:
        print_json({"copied": [str(path) for path in copied], "kept": [str(p) for p in kept]})
        return 0
    target = arguments.folder / "configs"
    print(f"{target}: {len(copied)} files copied, {len(kept)} that were there already kept")
    print("  next: rigwatch demo, or rigwatch study new STUDY --template emps")
    return 0

"""`rigwatch model new`: a user's own file, copied from a shipped model."""

import argparse
from pathlib import Path

from rigwatch.commands.common import check_folder, print_result

HELP = "start a model of your own from a copy of a shipped one"
EXAMPLE = "  rigwatch model new my_rig.toml --like mass-spring-damper"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("file", type=Path, help="the new file (.toml)")
    parser.add_argument(
        "--like", default="mass-spring-damper", metavar="MODEL",
        help="model to start from (default: %(default)s)",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.physics.engine.equations import model_named, model_text
    from rigwatch.wire.errors import ModelError
    from rigwatch.wire.new_file import write_new

    file, like = arguments.file, arguments.like
    check_folder(file)
    name = model_named(like).name
    text = model_text(like).replace(f'name = "{name}"', f'name = "{file.stem}"', 1)
    write_new(file, text, raises=ModelError)
    told = f"{file}: begun from {like}; next: rigwatch model check {file}"
    print_result(arguments, {"file": file, "like": like}, told)
    return 0

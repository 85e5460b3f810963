"""`rigwatch model show`: a model's file, as it ships or as one's own."""

import argparse

from rigwatch.commands.common import print_json

HELP = "print a model's file, or its parts as JSON"
EXAMPLE = "  rigwatch model show servo-pneumatic"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("model", help="name of a shipped model, or a file")


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.physics.engine.equations import model_named, model_text

    if arguments.json:
        print_json(model_named(arguments.model))
    else:
        print(model_text(arguments.model), end="")
    return 0

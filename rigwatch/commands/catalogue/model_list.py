"""`rigwatch model list`: the models that ship."""

import argparse

from rigwatch.commands.common import print_result

HELP = "list the models that ship with rigwatch"
EXAMPLE = "  rigwatch model list"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action: none."""
    del parser


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.physics.engine.equations import shipped_models

    found = shipped_models()
    summaries = {name: model.summary for name, model in sorted(found.items())}
    print_result(arguments, summaries, (f"{name:20} {text}" for name, text in summaries.items()))
    return 0

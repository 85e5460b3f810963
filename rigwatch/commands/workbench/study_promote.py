"""`rigwatch study promote`: passes the model to the running monitor, else to its file."""

import argparse
from pathlib import Path

from rigwatch.commands.common import add_user, print_json, say

HELP = "promote the accepted model to the monitor of a rig, or roll back to the previous one"
EXAMPLE = """\
  rigwatch study promote emps --rig emps-rig.toml
  rigwatch study promote emps --rig emps-rig.toml --rollback"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument(
        "--rig", type=Path, required=True, metavar="CONFIG", help="the rig's configuration"
    )
    parser.add_argument("--rollback", action="store_true", help="roll back to the previous model")
    add_user(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if the other model is in force; 1 if the monitor refuses it."""
    from rigwatch.workbench.steps import hand_over, model_path
    from rigwatch.workbench.study import open_study

    study = open_study(arguments.study)
    done = hand_over(study, arguments.rig, arguments.user, rollback=arguments.rollback, say=say)
    found, reply = done.found, done.reply
    if arguments.json:
        residual = {"before": found.before, "after": found.after} if found else None
        learnt = found.learnt if found else None
        print_json({"granted": reply, "live": done.live, "residual": residual, "learnt": learnt})
    else:
        if found:
            fall = f"{found.before:.4g} → {found.after:.4g} m/s^2"
            print(f"the monitor's residual on the recordings held out: {fall}")
        print(f"{model_path(arguments.rig)}: {reply.text}")
    return 0 if reply.done else 1

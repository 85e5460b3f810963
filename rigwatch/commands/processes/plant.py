"""`rigwatch plant`: serves the simulated rig, controls a running one, or records a scenario."""

import argparse
import json
from pathlib import Path

from rigwatch.commands.common import POSITIVE, number, whole

HELP = (
    "serve the simulated rig, change it while it runs, or record a scenario faster than real time"
)
EXAMPLE = """  rigwatch plant configs/demo.toml
  rigwatch plant configs/demo.toml --set friction=0.4 --over 5
  rigwatch plant configs/demo.toml --line-fault flip=20
  rigwatch plant --session out.mcap configs/scenarios/experiment_1.toml"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "file", type=Path, metavar="FILE", help="configuration of the rig; a scenario to record"
    )
    talk = parser.add_argument_group("control the running simulated rig")
    talk.add_argument(
        "--set", action="append", default=[], metavar="EFFECT=VALUE", help="set an effect"
    )
    talk.add_argument(
        "--over", type=number(0), default=0.0, metavar="S", help="change it over S seconds"
    )
    talk.add_argument("--clear", action="store_true", help="remove all effects")
    talk.add_argument("--effects", action="store_true", help="list the effects and their values")
    talk.add_argument(
        "--line-fault", metavar="NAME[=FRAMES]", help="disturb the serial line for some frames"
    )
    talk.add_argument("--tell", metavar="LINE", help="any other command, such as 'restart'")
    record = parser.add_argument_group("record faster than real time")
    record.add_argument("--session", type=Path, metavar="OUT.mcap", help="write a session here")
    record.add_argument(
        "--seconds", type=POSITIVE, metavar="S", help="length; default: the scenario's"
    )
    record.add_argument(
        "--seed", type=whole(0), default=1, metavar="N", help="seed of the sensors' noise"
    )


def run(arguments: argparse.Namespace) -> int:
    """Serve until a signal ends it, or execute the request and return."""
    lines = _lines(arguments)
    if arguments.session:
        return _record(arguments)
    if lines:
        return _talk(arguments, lines)
    from sim_plant.__main__ import main

    return main(arguments.file)


def _lines(arguments: argparse.Namespace) -> list[str]:
    over = f" over {arguments.over:g}" if arguments.over else ""
    lines = ["clear"] if arguments.clear else []
    lines += [f"set {text}{over}" for text in arguments.set]
    if arguments.line_fault:
        name, _, frames = arguments.line_fault.partition("=")
        lines.append(f"fault {name} {frames}".strip())
    lines += [arguments.tell] if arguments.tell else []
    return lines + (["effects"] if arguments.effects else [])


def _talk(arguments: argparse.Namespace, lines: list[str]) -> int:
    from rigwatch.wire.rig_config import load_rig
    from sim_plant.serve import ask, control_path

    path = control_path(load_rig(arguments.file).rig.id)
    answers = {line: ask(path, line) for line in lines}
    if arguments.json:
        print(json.dumps(answers))
    else:
        for answer in answers.values():
            print(answer.replace(" ", "\n") if "=" in answer else answer)
    return 0


def _record(arguments: argparse.Namespace) -> int:
    from rigwatch.simulated import write_session

    samples = write_session(
        arguments.session, arguments.file, seed=arguments.seed, seconds=arguments.seconds
    )
    figures = {"session": str(arguments.session), "samples": samples, "seed": arguments.seed}
    print(json.dumps(figures) if arguments.json else f"{samples} samples in {arguments.session}")
    return 0

"""`rigwatch structure`: structures of masses and springs, identified from their motion."""

import argparse
import importlib

HELP = "identify structures from their motion, and find damage in them"
EXAMPLE = """\
  rigwatch structure simulate configs/structures/kabe_antenna.toml antenna.csv
  rigwatch structure identify configs/structures/kabe_antenna.toml antenna.csv
  rigwatch structure compare configs/structures/kabe_antenna.toml antenna.csv --report antenna.html
  rigwatch structure damage configs/structures/kabe_antenna.toml antenna.csv --save antenna.rrd
  rigwatch structure watch configs/structures/kabe_antenna.toml rig.toml
  rigwatch structure modes configs/structures/kabe_antenna.toml --svg antenna.svg"""

ACTIONS: dict[str, str] = {
    # name: module below rigwatch.commands.structures
    "simulate": "structure_simulate",
    "identify": "structure_identify",
    "compare": "structure_compare",
    "damage": "structure_damage",
    "modes": "structure_modes",
    "watch": "structure_watch",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One parser an action."""
    actions = parser.add_subparsers(metavar="ACTION", required=True, dest="action")
    for name, module_name in ACTIONS.items():
        module = importlib.import_module(f"rigwatch.commands.structures.{module_name}")
        action = actions.add_parser(
            name,
            help=module.HELP,
            description=module.HELP,
            epilog=f"example:\n{module.EXAMPLE}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        # After the action too; not given there, what was said before it stands.
        action.add_argument(
            "--json", action="store_true", default=argparse.SUPPRESS, help="print results as JSON"
        )
        module.add_arguments(action)
        action.set_defaults(act=module.run)


def run(arguments: argparse.Namespace) -> int:
    """The exit code of the action."""
    return int(arguments.act(arguments))

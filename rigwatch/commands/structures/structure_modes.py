"""`rigwatch structure modes`: natural modes, and the strain energy of each spring."""

import argparse
from pathlib import Path

from rigwatch.commands.common import file_or_name, print_json
from rigwatch.commands.structures.structure_files import add_report, write_page
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.new_file import write_new

HELP = "natural modes of a structure and the share of each spring in their strain energy"
EXAMPLE = """\
  rigwatch structure modes configs/structures/kabe_antenna.toml
  rigwatch structure modes configs/structures/kabe_antenna.toml --families --svg shares.svg
  rigwatch structure modes configs/structures/kabe_antenna.toml --report modes.html"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("structure", type=file_or_name("structures"), help="structure file (.toml)")
    parser.add_argument(
        "--families", action="store_true", help="count k1_6, k1_7, ... together as k1"
    )
    parser.add_argument(
        "--only", metavar="PREFIX", help="only springs with this prefix, such as k1"
    )
    parser.add_argument(
        "--svg", type=Path, metavar="FILE", help="also draw the shares into this file"
    )
    add_report(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if the modes are found."""
    from rigwatch.structures.model import by_family, load_structure, strain_energy
    from rigwatch.structures.report import modes_html, shares_svg

    structure = load_structure(arguments.structure)
    energy = strain_energy(structure)
    if arguments.report:
        write_page(arguments.report, modes_html(structure, energy))
    if arguments.only:
        chosen = [name for name in energy.springs if name.startswith(arguments.only)]
        if not chosen:
            found = f"springs {', '.join(energy.springs)}"
            raise ConfigError(arguments.structure, "springs", found, f"some {arguments.only}*")
        energy = energy.grouped({name: (name,) for name in chosen})
    if arguments.families:
        energy = energy.grouped(by_family(energy.springs))
    if arguments.svg:
        drawn = shares_svg(energy, f"{structure.name}: shares of strain energy")
        write_new(arguments.svg, drawn, replace=True)
    if arguments.json:
        rows = [dict(zip(energy.springs, row, strict=True)) for row in energy.shares.tolist()]
        print_json({"omega": energy.omega.tolist(), "shares": rows, "ranking": energy.ranking()})
        return 0
    print("rad/s  " + " ".join(f"{name:>7}" for name in energy.springs))
    for omega, shares in zip(energy.omega, energy.shares, strict=True):
        print(f"{omega:5.2f}  " + " ".join(f"{100 * share:6.1f}%" for share in shares))
    print("most to suspect: " + ", ".join(energy.ranking()[:6]))
    return 0

"""`rigwatch structure identify`: identifies masses, springs and dampers from a record."""

import argparse

from rigwatch.commands.common import print_result
from rigwatch.commands.structures.structure_files import (
    add_problem,
    add_report,
    as_written,
    lines_of,
    plain,
    problem_from,
    units_of,
    write_report,
)
from rigwatch.commands.structures.structure_view import add_views, draw_methods, wanted

HELP = "identify the unknowns of a structure from a record"
EXAMPLE = """\
  rigwatch structure identify configs/structures/kabe_antenna.toml antenna.csv
  rigwatch structure identify antenna.toml antenna.csv --method direct --report antenna.html
  rigwatch structure identify antenna.toml antenna.csv --unknown k1_6=1300 --unknown m4=0.8"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    add_problem(parser)
    parser.add_argument(
        "--method",
        default="shooting",
        help="shooting (default), quasilinearization, gauss-newton, kalman or direct",
    )
    parser.add_argument(
        "--integrator",
        choices=("dormand-prince", "runge-kutta"),
        help="integrator of quasilinearization: dormand-prince (the thesis's) or runge-kutta",
    )
    add_report(parser)
    add_views(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if the method converged, else 1."""
    from rigwatch.structures.identification import solved

    drawn = wanted(arguments)
    problem = problem_from(arguments)
    found = solved(arguments.method, problem, **_options(arguments))
    if arguments.report:
        write_report(arguments, problem, {found.method: found})
    if drawn:
        draw_methods(arguments, problem, {found.method: found})
    units = units_of(problem)
    found = as_written(found, units)
    print_result(arguments, plain(found, units), lines_of(found, units))
    return 0 if found.converged else 1


def _options(arguments: argparse.Namespace) -> dict[str, str]:
    from rigwatch.wire.errors import ModelError

    if arguments.integrator is None:
        return {}
    if arguments.method != "quasilinearization":
        raise ModelError(
            f"--integrator: found the method {arguments.method}, expected quasilinearization"
        )
    return {"integrator": arguments.integrator}

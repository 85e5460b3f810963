"""`rigwatch structure compare`: runs every identification method on the same record."""

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

HELP = "run every identification method on the same record"
EXAMPLE = """\
  rigwatch structure compare configs/structures/kabe_antenna.toml antenna.csv
  rigwatch structure compare antenna.toml antenna.csv --report methods.html
  rigwatch structure compare antenna.toml antenna.csv --save methods.rrd"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    add_problem(parser)
    add_report(parser)
    add_views(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if at least one method converged, else 1."""
    from rigwatch.structures.identification import METHODS, Identification, solved
    from rigwatch.wire.errors import ModelError

    drawn = wanted(arguments)
    problem = problem_from(arguments)
    results: dict[str, Identification | str] = {}
    for method in METHODS:
        try:
            results[method] = solved(method, problem)
        except ModelError as error:
            results[method] = str(error)
    if arguments.report:
        write_report(arguments, problem, results)
    if drawn:
        draw_methods(arguments, problem, results)
    units = units_of(problem)
    written = {m: r if isinstance(r, str) else as_written(r, units) for m, r in results.items()}
    lines: list[str] = []
    for method, result in written.items():
        lines += [f"{method}: {result}"] if isinstance(result, str) else lines_of(result, units)
    data = {m: {"error": r} if isinstance(r, str) else plain(r, units) for m, r in written.items()}
    print_result(arguments, data, lines)
    good = any(not isinstance(r, str) and r.converged for r in results.values())
    return 0 if good else 1

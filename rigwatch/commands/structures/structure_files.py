"""Shared parts of `rigwatch structure`: files, unknowns, formatted figures."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import file_or_name, number, say, whole
from rigwatch.wire.errors import ModelError
from rigwatch.wire.new_file import write_new

if TYPE_CHECKING:
    from rigwatch.physics.engine.equations import Model
    from rigwatch.structures.identification import Identification, Problem
    from rigwatch.structures.model import Structure


RECORD = "record with columns t, x6, ... (.csv or .npz), or a session (.mcap or its folder)"


def add_problem(parser: argparse.ArgumentParser) -> None:
    """Arguments for structure, record and unknowns."""
    parser.add_argument(
        "structure", type=file_or_name("structures"), help="structure or model file (.toml)"
    )
    add_record(parser)
    parser.add_argument(
        "--unknown",
        action="append",
        metavar="NAME[=GUESS]",
        help="an unknown with its guess, such as k1_6=1300, m4 or v6(0); replaces the file's",
    )
    parser.add_argument(
        "--weighting", default="uniform", help="uniform, exponential:SECONDS or jacobi:A,B"
    )
    parser.add_argument(
        "--first", type=whole(0), default=0, metavar="SAMPLE", help="first sample used"
    )


def add_test(parser: argparse.ArgumentParser, within: str, settle: str) -> None:
    """Arguments of the damage test: `within` names the period of the false-alarm rate."""
    parser.add_argument(
        "--false-alarms", type=number(0, 1, above=True), default=0.01, metavar="P",
        help=f"probability of any false alarm {within}, default 0.01",
    )  # fmt: skip
    parser.add_argument("--settle", type=number(0), default=2.0, metavar="SECONDS", help=settle)
    parser.add_argument(
        "--known",
        action="store_true",
        help="take the file's values as true, even those marked unknown",
    )
    parser.add_argument(
        "--moving",
        action="store_true",
        help="the structure moves at the first sample, instead of being as in the file",
    )


def add_report(parser: argparse.ArgumentParser) -> None:
    """The argument for a web page."""
    parser.add_argument("--report", type=Path, metavar="FILE.html", help="write a web page")


def write_page(path: Path, text: str) -> None:
    """Write a web page and report it.

    Raises:
        ModelError: it cannot be written.
    """
    write_new(path, text, replace=True, raises=ModelError)
    say(f"report: {path}")


def add_record(parser: argparse.ArgumentParser) -> None:
    """The argument for a record: a table or a session."""
    parser.add_argument("record", type=Path, help=RECORD)


def problem_from(arguments: argparse.Namespace) -> "Problem":
    """The identification problem from the arguments of `add_problem`.

    Raises:
        ModelError: as in `problem_of`, or a guess is not a number.
    """
    from rigwatch.structures.identification import problem_of
    from rigwatch.structures.records import read_any

    names, guesses = unknowns_of(arguments)
    return problem_of(
        subject_of(arguments.structure),
        read_any(arguments.record),
        names,
        guesses,
        weighting=arguments.weighting,
        first=arguments.first,
    )


def unknowns_of(arguments: argparse.Namespace) -> tuple[list[str] | None, dict[str, float]]:
    """Names and guesses of `--unknown`; None to take the file's.

    Raises:
        ModelError: a guess is not a number.
    """
    if not arguments.unknown:
        return None, {}
    names, guesses = [], {}
    for text in arguments.unknown:
        name, equals, number = text.partition("=")
        names.append(name)
        if equals:
            try:
                guesses[name] = float(number)
            except ValueError:
                raise ModelError(f"--unknown {name}: found {number!r}, expected a number") from None
    return names, guesses


def subject_of(path: Path) -> "Structure | Model":
    """The structure in the file, or the model if it has equations of its own.

    Raises:
        ConfigError: it is neither.
    """
    from rigwatch.physics.engine.equations import load_model
    from rigwatch.structures.model import load_structure
    from rigwatch.wire.typed_files import loads

    try:
        has_equations = "states" in loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        has_equations = False
    return load_model(path) if has_equations else load_structure(path)


def units_of(problem: "Problem") -> dict[str, str]:
    """The unit of each unknown in the file, by name; x(0) has that of the state x."""
    system = problem.system
    units = {name: p.shown or p.unit for name, p in system.parameters.items()}
    units |= {f"{name}(0)": state.shown or state.unit for name, state in system.states.items()}
    return {name: units[name] for name in problem.names}


def as_written(found: "Identification", units: Mapping[str, str]) -> "Identification":
    """The result, converted from SI to the units of the model's file."""
    from rigwatch.wire.units import unit_of

    given = {name: unit_of(units[name]) for name in found.names}
    if all(unit.plain for unit in given.values()):
        return found
    iterations = found.iterations.copy()
    for column, name in zip(iterations.T, found.names, strict=True):
        column[:] = [given[name].from_si(value) for value in column.tolist()]
    values = {name: given[name].from_si(found.parameters[name]) for name in found.names}
    ends = {
        name: (given[name].from_si(low), given[name].from_si(high))
        for name, (low, high) in found.intervals.items()
        if name in given
    }
    return replace(
        found, iterations=iterations, parameters={**found.parameters, **values}, intervals=ends
    )


def figures(found: "Identification", units: Mapping[str, str] | None = None) -> list[str]:
    """One line per unknown: estimate and 95 % interval, with its unit if `units` are given."""
    width = max(len(name) for name in found.names)
    lines = []
    for name in found.names:
        low, high = found.intervals[name]
        unit = f" {units[name]}" if units else ""
        vague = "  not determined by this record" if name in found.undetermined else ""
        lines.append(
            f"  {name:<{width}}  {found.parameters[name]:>13.6g}   [{low:.6g}, {high:.6g}]"
            f"{unit}{vague}"
        )
    return lines


def lines_of(found: "Identification", units: Mapping[str, str]) -> list[str]:
    """How it ended, its figures, and its remarks."""
    state = "converged" if found.converged else "did not converge"
    ended = f"{found.method}: {state} in {len(found.iterations)} iterations, {found.seconds:.2f} s"
    return [ended, *figures(found, units), *(f"  note: {remark}" for remark in found.remarks)]


def plain(found: "Identification", units: Mapping[str, str]) -> dict[str, object]:
    """The identification as plain data with the unknowns' units, for JSON."""
    return {
        "method": found.method,
        "converged": found.converged,
        "seconds": found.seconds,
        "iterations": [
            dict(zip(found.names, row.tolist(), strict=True)) for row in found.iterations
        ],
        "parameters": {
            name: {
                "value": found.parameters[name],
                "unit": units[name],
                "interval": list(found.intervals[name]),
            }
            for name in found.names
        },
        "undetermined": list(found.undetermined),
        "remarks": list(found.remarks),
    }


def write_report(
    arguments: argparse.Namespace, problem: "Problem", results: "Mapping[str, Identification | str]"
) -> None:
    """The page of `--report`; a result is that of a method, or its error message.

    Raises:
        ModelError: it cannot be written.
    """
    from rigwatch.structures.report import Findings, report_html

    found = {method: result for method, result in results.items() if not isinstance(result, str)}
    failed = {method: result for method, result in results.items() if isinstance(result, str)}
    write_page(
        arguments.report, report_html(Findings(problem, arguments.record.name, found, failed))
    )

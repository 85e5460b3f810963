"""Parameters from the single numbers that logs state beside their columns, such as mass or gain."""

from collections.abc import Mapping

from rigwatch.physics.engine.equations import Model
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.wire.exchange import Table
from rigwatch.wire.texts import read_header
from rigwatch.wire.units import unit_of


def stated_values(
    table: Table, stated: Mapping[str, str], model: Model
) -> tuple[dict[str, float], list[str]]:
    """Parameters of one log in the units of the model, and remarks on units that are not given.

    Args:
        table: the log.
        stated: parameter = "number" or "number[unit]"; without a unit that in the number's name, as
            in `mass_g`, or that of the parameter.
        model: whose parameters they are.

    Raises:
        ModelError: the log has no such number, or its unit is not of the parameter's kind.
    """
    found, remarks = dict[str, float](), list[str]()
    for name, told in stated.items():
        found[name], told_of_it = _value(table, name, told, model)
        remarks += told_of_it
    return found, remarks


def unused_numbers(table: Table, stated: Mapping[str, str]) -> list[str]:
    """A remark on the numbers of a log that no parameter takes, if there are any."""
    used = {_number(told) for told in stated.values()}
    names = [name for name in table.scalars if name not in used]
    if not names:
        return []
    return [f"states {', '.join(names)}; set a parameter from one with --set NAME={names[0]}"]


def _value(table: Table, name: str, told: str, model: Model) -> tuple[float, list[str]]:
    """The parameter's value, and a remark if the number's unit is not given."""
    option, number = f"--set {name}={told}", _number(told)
    if name not in model.parameters:
        raise ModelError(f"{option}: found {name!r}{nearest(name, model.parameters)}")
    if number not in table.scalars:
        log = table.path.stem
        hint = (
            nearest(number, table.scalars)
            if table.scalars
            else f" beside its columns; give it with --set {log}:{name}=VALUE"
        )
        raise ModelError(f"{option}: {table.path}: found no number {number!r}{hint}")
    unit = model.parameters[name].shown or model.parameters[name].unit
    wanted = unit_of(unit)
    own, remarks = _unit(told, unit)
    given = unit_of(own)
    if given.dimension != wanted.dimension:
        raise ModelError(f"{option}: found {given.si}, expected a unit like {unit}")
    return wanted.from_si(given.to_si(table.scalars[number])), remarks


def _unit(told: str, wanted: str) -> tuple[str, list[str]]:
    """Unit of a number: given in brackets, in its name, or else that of the parameter."""
    if "[" in told:
        return told.partition("[")[2].rstrip("] "), []
    dimension = unit_of(wanted).dimension
    named = (one for one in read_header(told).units if unit_of(one).dimension == dimension)
    if own := next(named, ""):
        return own, [f"{told}: read in {own}, as its name says"]
    return wanted, [] if wanted in ("", "1") else [f"{told}: no unit in its name, assumed {wanted}"]


def _number(told: str) -> str:
    return told.partition("[")[0].strip()

"""Parameters from the single numbers that logs state beside their columns, such as mass or gain."""

from collections.abc import Mapping

from rigwatch.physics.engine.equations import Model
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.wire.exchange import Table
from rigwatch.wire.units import unit_of


def stated_values(table: Table, stated: Mapping[str, str], model: Model) -> dict[str, float]:
    """Parameters of one log, in the units of the model.

    Args:
        table: the log.
        stated: parameter = "number" or "number[unit]"; without a unit that of the parameter.
        model: whose parameters they are.

    Raises:
        ModelError: the log has no such number, or its unit is not of the parameter's kind.
    """
    return {name: _value(table, name, told, model) for name, told in stated.items()}


def unused_numbers(table: Table, stated: Mapping[str, str]) -> list[str]:
    """A remark on the numbers of a log that no parameter takes, if there are any."""
    used = {_number(told) for told in stated.values()}
    names = [name for name in table.scalars if name not in used]
    if not names:
        return []
    return [f"states {', '.join(names)}; set a parameter from one with --set NAME={names[0]}"]


def _value(table: Table, name: str, told: str, model: Model) -> float:
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
    given = unit_of(told.partition("[")[2].rstrip("] ")) if "[" in told else wanted
    if given.dimension != wanted.dimension:
        raise ModelError(f"{option}: found {given.si}, expected a unit like {unit}")
    return wanted.from_si(given.to_si(table.scalars[number]))


def _number(told: str) -> str:
    return told.partition("[")[0].strip()

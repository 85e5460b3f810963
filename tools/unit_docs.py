"""Prints docs/units.md from the table that every file is read with: `make docs` writes it."""

from collections.abc import Iterator

from rigwatch.wire.units import describe, unit_of
from rigwatch.wire.units.unit_table import PREFIXES, QUANTITIES

HEAD = """<!-- Printed by `make docs` from the table in the code. -->

# Units

Models, effects, studies and imports accept the same units. Internally all values are SI: they are
converted when a file is read, and `compare`, `explain`, `add`, `report` and `study.toml` give a
parameter in the unit of its model or effect file (`shown = "mm"` next to `unit` selects another).
Equations compute in SI. Texts and tables tell the errors of an output in the unit of its model file
or, where that has none but SI, in that of the log (`shown = { speed = "rpm" }` in the study); JSON
and the ledger have them in SI, with the unit named.

* Products by a space, `*` or `·`; quotients by `/`, which applies to the next factor only: `N s/m`,
  `m/(s V)`, `kN/mm`. Powers by `^`, also broken ones: `m/s^2`, `l/(min bar^0.5)`, `V^(1/2)`;
  `m/s2` and `m/s²` are read, too. In equations a power is `**`.
* `g` is the gram; standard gravity is `g0` or `gn`. Accelerometers are often labelled g, which
  `study new` reads as standard gravity beside an acceleration; an import refuses it and suggests
  `g0` or `gram`.
* A temperature that stands alone is absolute: 20 degC are 293.15 K. Within a product it is a
  difference: W/degC is W/K. A difference by itself is written in K.
* Angles are pure numbers (rad). Hz counts turns and rad/s angles: a channel in one is refused where
  the model has the other, as is one in 1/s or 1/min where the model has rad/s.
* Headers of logs may use other words: RPM, U/min, r/min, Volt, rad/sec, N-m, min-1. In a header,
  1/min of an angular speed is rpm. Brackets that hold no unit are refused, with the option that
  states it.
* A channel of a recording whose unit measures something else than the model's signal is refused;
  one without a unit is taken in SI.

"""


def page() -> str:
    """The whole page."""
    return HEAD + "\n".join(_rows()) + f"\n\nPrefixes: {_prefixes()}.\n"


def _rows() -> Iterator[str]:
    yield "| quantity | SI unit | in base units | others, in SI | with prefixes |"
    yield "| --- | --- | --- | --- | --- |"
    for q in QUANTITIES:
        others = ", ".join(_other(name) for name in q.units if name not in (q.si, ""))
        prefixed = ", ".join(f"`{name}`" for name in q.prefixed)
        base = describe(unit_of(q.si).dimension)
        yield f"| {q.name} | `{q.si}` | {base} | {others} | {prefixed} |"


def _other(name: str) -> str:
    unit = unit_of(name)
    offset = f" + {float(unit.offset):.6g}" if unit.offset else ""
    factor = "" if unit.factor == 1 and offset else f" × {float(unit.factor):.10g}"
    return f"`{name}`" if unit.plain else f"`{name}`{factor}{offset}"


def _prefixes() -> str:
    return ", ".join(f"`{name}` {float(size):g}" for name, size in PREFIXES.items())

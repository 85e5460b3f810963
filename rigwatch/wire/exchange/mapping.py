"""Which column of a foreign file becomes which channel: from a TOML file or from `--map` options.

position = "qm[mm]"            column qm, in millimetres
force    = "vir * gtau [N]"    column vir times the scalar gtau of the same file, in newtons
force    = "vir*35.15 - 3[N]"  the same with numbers
"""

import math
import re
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta, field

from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.typed_files import Section

Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_-]+$")]
_WITH_UNIT = re.compile(r"^(?P<source>.*?)\s*\[(?P<unit>[^\[\]]*)\]$", re.DOTALL)
_NUMBER = r"\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?"
_SCALED = re.compile(
    rf"^(?P<column>.+?)(?:\s*\*\s*(?P<factor>-?(?:{_NUMBER})|[A-Za-z_]\w*))?"
    rf"(?:\s*(?P<sign>[+-])\s*(?P<offset>{_NUMBER}))?$",
    re.DOTALL,
)


class ImportMapping(Section, frozen=True):
    """How a foreign file is read."""

    channels: Annotated[
        dict[str, str], Meta(description='channel = "column * factor + offset [unit]"')
    ] = field(default_factory=dict)
    time: Annotated[
        str, Meta(description='column of the time with its unit, such as "t[ms]", empty for none')
    ] = ""
    rate: Annotated[
        Annotated[float, Meta(ge=1e-6, le=1e9)] | None,
        Meta(description="sample rate [Hz]; required without a time column"),
    ] = None
    format: Annotated[
        Literal["auto", "csv", "mat", "parquet", "json"],
        Meta(description="auto: by the file's ending"),
    ] = "auto"
    rig: Annotated[Name, Meta(description="the rig's id in the session")] = "imported"
    device: Annotated[Name, Meta(description="the device's name in the session")] = "rig"
    delimiter: Annotated[
        str, Meta(description="between the cells of CSV; auto, whitespace or a character")
    ] = "auto"
    columns: Annotated[
        tuple[str, ...], Meta(description="names of the columns of CSV without a header line")
    ] = ()
    skip_rows: Annotated[int, Meta(ge=0, description="rows of data left out at the start")] = 0
    max_hole: Annotated[
        float, Meta(gt=0, description="longest step that is bridged, in sample periods")
    ] = 10.0
    held: Annotated[
        tuple[str, ...],
        Meta(
            description="channels that keep each value until the next row, as a command does: if"
            " steps are uneven, a sample is their mean until the next one"
        ),
    ] = ()
    flag_missing: Annotated[
        bool, Meta(description="take NaN and empty cells as invalid samples, not as an error")
    ] = False
    any_unit: Annotated[
        bool,
        Meta(description="accept any unit at `position`, `velocity` and other names of fixed kind"),
    ] = False
    notes: Annotated[str, Meta(description="remark kept in the session, such as the source")] = ""


@dataclass(frozen=True, slots=True)
class Source:
    """Where a channel's values come from: SI = conversion of (factor · column + offset).

    `factor` is a number, or the name of a scalar in the file.
    """

    column: str
    factor: float | str
    offset: float
    unit: str


def parse_source(channel: str, text: str, columns: tuple[str, ...]) -> Source:
    """The source that `text` describes, in a file that has `columns`.

    Raises:
        ImportDataError: the text has no unit, is malformed, or names a column that is not there.
    """
    match = _WITH_UNIT.match(text.strip())
    if match is None:
        raise ImportDataError(
            f"{channel}: found {text!r}, expected column[unit], such as x[mm] or u*35.15[N], and"
            " [1] for what has no unit"
        )
    source, unit = match["source"], match["unit"].strip()
    if source not in columns and text.strip() in columns:
        source = text.strip()  # the header itself has its unit in brackets
    if source in columns:
        return Source(source, 1.0, 0.0, unit)
    parts = _SCALED.match(source)
    column = parts["column"] if parts else source
    if parts is None or column not in columns:
        begun = next((name for name in columns if name.startswith(f"{column} [")), "")
        expected = f"expected {begun!r} with its own brackets, or " if begun else "expected "
        raise ImportDataError(
            f"{channel}: found no column {column!r}, {expected}one of"
            f" {', '.join(columns) or 'none'}"
        )
    factor, offset = _factor(parts["factor"]), _offset(parts["sign"], parts["offset"])
    if not all(math.isfinite(x) for x in (factor, offset) if isinstance(x, float)):
        raise ImportDataError(f"{channel}: found {source!r}, expected finite numbers")
    return Source(column, factor, offset, unit)


def _factor(text: str | None) -> float | str:
    if text is None:
        return 1.0
    try:
        return float(text)
    except ValueError:
        return text


def _offset(sign: str | None, text: str | None) -> float:
    return float(f"{sign}{text}") if text is not None else 0.0


def parse_map_option(text: str) -> tuple[str, str]:
    """Channel and source of a `--map channel=source` option.

    Raises:
        ImportDataError: there is no channel or no source.
    """
    channel, equals, source = text.partition("=")
    if not (channel.strip() and equals and source.strip()):
        expected = "channel=column[unit], such as position=qm[mm]"
        raise ImportDataError(f"--map: found {text!r}, expected {expected}")
    return channel.strip(), source.strip()

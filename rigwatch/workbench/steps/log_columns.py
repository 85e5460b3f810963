"""Matches columns of a log to a model's signals: by name, otherwise by the only matching unit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rigwatch.physics.engine.equations import Input, Model, Output
from rigwatch.wire.errors import ModelError
from rigwatch.wire.exchange import Header, read_header
from rigwatch.wire.units import unit_of

TIMES = ("time", "t", "timestamp", "time_stamp", "seconds", "sec")
"""Names of a time column."""


@dataclass(frozen=True)
class Matched:
    """Column mapping of a log.

    Attributes:
        channels: channel = "column[unit]".
        time: "column[unit]", empty if the log has none.
        rates: derived channels: source channel and number of differentiations.
        remarks: assumptions made, for the user.
    """

    channels: dict[str, str]
    time: str
    rates: dict[str, tuple[str, int]]
    remarks: tuple[str, ...]


def matched(columns: Sequence[str], model: Model, given: Mapping[str, str]) -> Matched:
    """The columns of a model's signals.

    Args:
        columns: of the log.
        model: the model whose signals are matched.
        given: mapping given by the user, channel = "column[unit]".

    Raises:
        ModelError: no column, or more than one, matches a signal; the text names the option.
    """
    headers = [read_header(column) for column in columns]
    time = next((header for header in headers if header.name in TIMES), None)
    free = [header for header in headers if header is not time]
    signals: dict[str, Input | Output] = {**model.inputs, **model.outputs}
    found, remarks = dict(given), list[str]()
    missing = dict[str, Input | Output]()
    for name, signal in signals.items():
        channel = signal.channel or name
        if channel in found:
            continue
        column = _column(name, channel, signal, free)
        if column is None:
            missing[name] = signal
            continue
        unit = _unit(column, signal)
        found[channel] = f"{column.column}[{unit}]"
        free.remove(column)
        if not column.units:
            remarks.append(f"{column.column}: no unit in its header, assumed {unit}")
    measured = {s.channel or name: s for name, s in signals.items() if name not in missing}
    rates = dict[str, tuple[str, int]]()
    for name, signal in missing.items():
        channel = signal.channel or name
        made = _rate(signal, measured)
        if made is None:
            raise ModelError(_unknown(name, channel, signal, columns))
        rates[channel] = made
    if time is not None and not time.units:
        remarks.append(
            f"{time.column}: no unit in its header, assumed s; for ms give --time"
            f" '{time.column}[ms]'"
        )
    told = f"{time.column}[{_time_unit(time)}]" if time else ""
    return Matched(found, told, rates, tuple(remarks))


def _time_unit(time: Header) -> str:
    return time.units[0] if time.units else "s"


def _column(
    name: str, channel: str, signal: Input | Output, headers: Sequence[Header]
) -> Header | None:
    """The column of a signal: by name, otherwise the only one with a matching unit."""
    suiting = [header for header in headers if not header.units or _fits(header, signal)]
    wanted = {name.lower(), channel.lower()}
    named = [header for header in suiting if header.name in wanted]
    alike = [h for h in suiting if any(_within(word, h.name) for word in wanted)]
    measured = [header for header in suiting if header.units]
    for chosen in (named, alike, measured):
        if len(chosen) == 1:
            return chosen[0]
    return None


def _within(word: str, name: str) -> bool:
    return word in name or (len(name) > 1 and word.startswith(name))


def _fits(header: Header, signal: Input | Output) -> bool:
    wanted = unit_of(signal.shown or signal.unit).dimension
    return any(unit_of(unit).dimension == wanted for unit in header.units)


def _unit(header: Header, signal: Input | Output) -> str:
    """The unit of a header: of its possible readings, the one that matches the signal."""
    wanted = unit_of(signal.shown or signal.unit).dimension
    fitting = (unit for unit in header.units if unit_of(unit).dimension == wanted)
    return next(fitting, signal.shown or signal.unit)


def _rate(signal: Input | Output, measured: Mapping[str, Input | Output]) -> tuple[str, int] | None:
    """The channel whose derivative a signal is, and the order of the derivative."""
    own = unit_of(signal.shown or signal.unit).dimension
    for order in (1, 2):
        for channel, other in measured.items():
            if unit_of(f"({other.shown or other.unit})/s^{order}").dimension == own:
                return channel, order
    return None


def _unknown(name: str, channel: str, signal: Input | Output, columns: Sequence[str]) -> str:
    unit = signal.shown or signal.unit
    return (
        f"found no unique column for {name} [{unit}] among {', '.join(columns)};"
        f" expected --map {channel}=COLUMN[{unit}]"
    )

"""Matches columns of a log to a model's signals: by name, otherwise by the only matching unit."""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction

from rigwatch.physics.engine.equations import Input, Model, Output
from rigwatch.wire.errors import ModelError
from rigwatch.wire.texts import Header, read_header
from rigwatch.wire.units import as_meant, is_unit, may_count_turns, unit_of

TIMES = ("time", "t", "timestamp", "time_stamp", "seconds", "sec")
"""Names of a time column."""
SET_VALUES = frozenset(
    (
        "cmd",
        "command",
        "commanded",
        "demand",
        "desired",
        "goal",
        "ref",
        "reference",
        "setpoint",
        "soll",
        "sp",
        "target",
    )
)
"""Words in the name of a column that has a set value, which no sensor has read."""
SHORTEST_HEAD = 4
"""Letters of a word that counts as what a compound is a kind of."""
PER_MINUTE = Fraction(1, 60)
AS_READ = {"g0": "standard gravity (g0)", "mg0": "thousandths of standard gravity (mg0)"}
IN_CELSIUS = "; for degrees Celsius give --map '{channel}={column}[degC]'"
_GIVEN_UNIT = re.compile(r"\[\s*([^\[\]]*?)\s*\]\s*$")


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


def matched(
    columns: Sequence[str],
    model: Model,
    given: Mapping[str, str],
    when: str = "",
    dated: Collection[str] = (),
    *,
    counted: bool = False,
) -> Matched:
    """The columns of a model's signals.

    Args:
        columns: of the log.
        model: the model whose signals are matched.
        given: mapping given by the user, channel = "column[unit]".
        when: the time's column given by the user.
        dated: columns that hold dates or times of day, which need no unit.
        counted: whether a rate is given, so that only a column named as the time is one.

    Raises:
        ModelError: no column, or more than one, matches a signal; the text names the option.
    """
    headers = [read_header(column) for column in columns]
    time = None if when else _time_of(headers, dated, model, counted=counted)
    free = [h for h in headers if h is not time and not when.startswith(h.column)]
    signals: dict[str, Input | Output] = {**model.inputs, **model.outputs}
    found, missing, remarks = _read(signals, given, headers, free)
    rates = _derived(model, missing, columns, [h for h in free if not _is_given(h, given)])
    if time is not None:
        when, more = _as_time(time, dated)
        remarks += more
    return Matched(found, when, rates, tuple(remarks))


def suggested(columns: Sequence[str], model: Model) -> dict[str, str]:
    """The "column[unit]" of each channel of a model that the headers alone tell.

    Args:
        columns: of the log.
        model: the model whose signals are looked for.
    """
    headers = [read_header(column) for column in columns]
    time = _time_of(headers, (), model, counted=False)
    free, found = [h for h in headers if h is not time], dict[str, str]()
    signals: dict[str, Input | Output] = {**model.inputs, **model.outputs}
    for name, column in _chosen(signals, free):
        channel = signals[name].channel or name
        with suppress(ModelError):
            found[channel] = f"{column.column}[{_unit(column, channel, signals[name])[0]}]"
    return found


def _read(
    signals: Mapping[str, Input | Output],
    given: Mapping[str, str],
    headers: Sequence[Header],
    free: list[Header],
) -> tuple[dict[str, str], list[str], list[str]]:
    """Columns by channel, names of the signals without one, and remarks.

    Args:
        signals: of the model.
        given: mapping given by the user.
        headers: of all columns.
        free: those that no signal has yet; the ones taken are removed.
    """
    found, remarks = dict(given), list[str]()
    missing = list[str]()
    for name, signal in signals.items():
        channel = signal.channel or name
        if channel in found:
            found[channel], told = _given(found[channel], channel, signal, headers)
            remarks += told
        else:
            missing.append(name)
    for name, column in _chosen({name: signals[name] for name in missing}, free):
        signal = signals[name]
        channel = signal.channel or name
        unit, told = _unit(column, channel, signal)
        found[channel] = f"{column.column}[{unit}]"
        missing.remove(name)
        remarks += told
    return found, missing, remarks


def _is_given(header: Header, given: Mapping[str, str]) -> bool:
    """Whether the user maps a channel to a column, whatever is done with it."""
    sources = (source.strip() for source in given.values())
    begins = [source for source in sources if source.startswith(header.column)]
    return any(not source[len(header.column) :][:1].isalnum() for source in begins)


def _derived(
    model: Model, missing: Sequence[str], columns: Sequence[str], free: Sequence[Header]
) -> dict[str, tuple[str, int]]:
    """The source channel and the number of differentiations of each signal without a column.

    Raises:
        ModelError: a signal is the rate of no channel, or may be that of several.
    """
    signals: dict[str, Input | Output] = {**model.inputs, **model.outputs}
    rates, unknown = dict[str, tuple[str, int]](), list[tuple[str, str, tuple[str, ...]]]()
    for name in missing:
        # What drives a machine, as a set value, does not tell how the machine has moved.
        sides = (model.inputs, model.outputs) if name in model.inputs else (model.outputs,)
        found = [_rates(signals[name], _measured_of(side, missing)) for side in sides]
        made = _nearest_named(name, next(filter(None, found), []))
        channel = signals[name].channel or name
        if len(made) != 1:
            sources = [source for source, _ in made]
            unknown.append(_unknown(name, channel, signals[name], free, sources))
            continue
        (rates[channel],) = made
    if unknown:
        named = " and ".join(told for told, *_ in unknown)
        options = _options(unknown)
        raise ModelError(
            f"found no unique column for {named} among {', '.join(columns)}; expected {options}"
        )
    return rates


def _measured_of(
    signals: Mapping[str, Input] | Mapping[str, Output], missing: Sequence[str]
) -> dict[str, Input | Output]:
    """The signals that have a column, by channel."""
    return {own.channel or name: own for name, own in signals.items() if name not in missing}


def _as_time(time: Header, dated: Collection[str]) -> tuple[str, list[str]]:
    """The time's "column[unit]", and a remark if the unit is assumed."""
    if time.column in dated:
        return f"{time.column}[s]", []
    assumed = (
        f"{time.column}: no unit in its header, assumed s; for ms give --time '{time.column}[ms]'"
    )
    return f"{time.column}[{_time_unit(time)}]", [] if time.units else [assumed]


def _time_of(
    headers: Sequence[Header], dated: Collection[str], model: Model, *, counted: bool
) -> Header | None:
    """The column of the time: by name, otherwise the only one with dates or a unit of time."""
    signals = {*model.inputs, *model.outputs}
    named = [h for h in headers if h.name in TIMES and (h.column in dated or _is_time(h))]
    stating = [h for h in headers if h.column in dated]
    measured = [h for h in headers if h.units and _is_time(h) and h.name not in signals]
    for chosen in (named[:1],) if counted else (named[:1], stating, measured):
        if len(chosen) == 1:
            return chosen[0]
    return None


def _is_time(header: Header) -> bool:
    return not header.units or unit_of(header.units[0]).dimension == unit_of("s").dimension


def _time_unit(time: Header) -> str:
    if time.unknown:
        raise ModelError(_no_unit(time, f"--time '{time.column}[s]' with the column's unit"))
    return time.units[0] if time.units else "s"


def _chosen(
    signals: Mapping[str, Input | Output], free: list[Header]
) -> Iterator[tuple[str, Header]]:
    """Signals and their columns: all by name first, so that the only unit left tells the others.

    Args:
        signals: to be found, by name.
        free: columns that no signal has yet; the ones taken are removed.
    """
    missing = list(signals)
    for choose in (_named, _akin, _measured):
        for name in tuple(missing):
            signal = signals[name]
            if column := choose(name, signal, free):
                free.remove(column)
                missing.remove(name)
                yield name, column


def _named(name: str, signal: Input | Output, headers: Sequence[Header]) -> Header | None:
    """The column of a signal by name, or by a part of it."""
    suiting = [header for header in headers if not header.units or _fits(header, signal)]
    wanted = {name.lower(), (signal.channel or name).lower()}
    named = [header for header in suiting if header.name in wanted]
    suiting = [header for header in suiting if not _is_set_value(header, signal)]
    alike = [h for h in suiting if any(_within(word, h.name) for word in wanted)]
    return next((chosen[0] for chosen in (named, alike) if len(chosen) == 1), None)


def _akin(name: str, signal: Input | Output, headers: Sequence[Header]) -> Header | None:
    """The column with a matching unit that shares most words with a signal's name.

    A compound counts as its last word, as `headwind` does for `wind`.
    """
    words = {word for word in name.lower().split("_") if len(word) > 1}

    def count(header: Header) -> int:
        own = header.name.split("_")
        return sum(any(_is_head(word, each) for each in own) for word in words)

    shared = {
        header: count(header)
        for header in headers
        if header.units and _fits(header, signal) and not _is_set_value(header, signal)
    }
    most = max(shared.values(), default=0)
    chosen = [header for header, count in shared.items() if count == most]
    return chosen[0] if most and len(chosen) == 1 else None


def _is_head(word: str, compound: str) -> bool:
    """Whether a word is another, or what that is a kind of."""
    return word == compound or (len(word) >= SHORTEST_HEAD and compound.endswith(word))


def _measured(_name: str, signal: Input | Output, headers: Sequence[Header]) -> Header | None:
    """The column of a signal if it is the only one with a matching unit that no name took."""
    suiting = [header for header in headers if header.units and _fits(header, signal)]
    suiting = [header for header in suiting if not _is_set_value(header, signal)]
    return suiting[0] if len(suiting) == 1 else None


def _is_set_value(header: Header, signal: Input | Output) -> bool:
    """Whether a column has what an output should be, and not what it is."""
    return isinstance(signal, Output) and not SET_VALUES.isdisjoint(header.name.split("_"))


def _within(word: str, name: str) -> bool:
    """Whether a signal's name is a part of a column's, or begins with it.

    A letter is in most words: it has to be one by itself, as in `x_1`.
    """
    if len(word) == 1:
        return word in name.split("_")
    return word in name or (len(name) > 1 and word.startswith(name))


def _fits(header: Header, signal: Input | Output) -> bool:
    return any(as_meant(unit, signal.shown or signal.unit) for unit in header.units)


def _unit(header: Header, channel: str, signal: Input | Output) -> tuple[str, list[str]]:
    """The unit of a header: of its possible readings, the one that matches the signal.

    Also a remark if it is assumed.

    Raises:
        ModelError: the header has brackets with something else, a unit of another quantity, or a
            rate where an angle matters.
    """
    wanted = signal.shown or signal.unit
    readings = ((as_meant(each, wanted), each) for each in header.units)
    unit, written = next((reading for reading in readings if reading[0]), ("", ""))
    if not unit and header.unknown and wanted not in ("", "1"):
        option = f"--map '{channel}={header.column}"
        known, scaled = f"{option}[UNIT]' with a known one", f"{option} * FACTOR [{wanted}]'"
        raise ModelError(_no_unit(header, f"{known} or {scaled}"))
    if not unit and header.units:
        raise ModelError(
            f"{header.column}: found the unit {header.units[0]} in the header for {channel}"
            f" [{wanted}], expected a unit of the same quantity; where the header is wrong, give"
            f" --map '{channel}={header.column}[{wanted}]'"
        )
    if not unit:
        return wanted, [
            f"{header.column}: no unit in its header, assumed {wanted}"
            + (IN_CELSIUS.format(channel=channel, column=header.column) if wanted == "K" else "")
        ]
    if turns := _as_turns(unit, wanted):
        return turns, [f"{header.column}: {unit} is read as {turns}"]
    if may_count_turns(unit, wanted):
        raise ModelError(
            f"{header.column}: found the unit {unit} for {channel} [{wanted}], which may count"
            f" turns or angles; expected --map '{channel}={header.column}[rev/s]' or '…[rad/s]'"
        )
    told = f"{header.column}: {written} is read as {AS_READ.get(unit, unit)}"
    return unit, [told] if unit != written else []


def _as_turns(unit: str, wanted: str) -> str:
    """`rpm` for 1/min where the model has an angle in a time; otherwise empty."""
    per_minute = may_count_turns(unit, wanted) and unit_of(unit).factor == PER_MINUTE
    return "rpm" if per_minute else ""


def _given(
    text: str, channel: str, signal: Input | Output, headers: Sequence[Header]
) -> tuple[str, list[str]]:
    """A column as the user maps it, with 1/min read as rpm where the model has an angle."""
    header = _header_typed(text.strip(), headers)
    if header is not None and header.units:
        own, told = _unit(header, channel, signal)
        return f"{header.column}[{own}]", told
    unit = _GIVEN_UNIT.search(text)
    if unit is None or not is_unit(unit[1]):
        return text, []
    turns = _as_turns(unit[1], signal.shown or signal.unit)
    if not turns:
        return text, []
    return f"{text[: unit.start()]}[{turns}]", [f"{text}: {unit[1]} is read as {turns}"]


def _header_typed(text: str, headers: Sequence[Header]) -> Header | None:
    """The header that is typed as it stands, or but for the blanks in front of its unit."""
    verbatim = {header.column: header for header in headers}
    without_unit = text.rpartition("[")[0].strip()
    if text in verbatim or without_unit in verbatim:
        return verbatim.get(text)
    packed = "".join(text.split())
    return next((h for h in headers if "".join(h.column.split()) == packed), None)


def _no_unit(header: Header, expected: str) -> str:
    return (
        f"{header.column}: found {header.unknown!r} in the header's brackets, which is no unit that"
        f" is known; expected {expected}"
    )


def _rates(signal: Input | Output, measured: Mapping[str, Input | Output]) -> list[tuple[str, int]]:
    """The channels whose derivative of the lowest order a signal may be, and that order."""
    own = unit_of(signal.shown or signal.unit).dimension
    for order in (1, 2):
        found = [
            (channel, order)
            for channel, other in measured.items()
            if unit_of(f"({other.shown or other.unit})/s^{order}").dimension == own
        ]
        if found:
            return found
    return []


def _nearest_named(name: str, found: list[tuple[str, int]]) -> list[tuple[str, int]]:
    """Of several channels those that share most words with a signal, as `load_angle` does with
    `load_speed`."""
    words = set(name.split("_"))
    shared = [len(words & set(channel.split("_"))) for channel, _ in found]
    return [each for each, count in zip(found, shared, strict=True) if count == max(shared)]


def _unknown(
    name: str,
    channel: str,
    signal: Input | Output,
    free: Sequence[Header],
    sources: Sequence[str] = (),
) -> tuple[str, str, tuple[str, ...]]:
    """A signal that no column is known to be, the option that names one, and columns for it.

    Args:
        name, channel, signal: the signal.
        free: columns that are no other signal's.
        sources: channels of which it may be the rate, if there are several.
    """
    unit = signal.shown or signal.unit
    fit = tuple(each.column for each in free if _fits(each, signal))
    rate = f", which may be the rate of {' or '.join(sources)}" if sources else ""
    option = f"--map '{channel}=COLUMN'" if fit else f"--map '{channel}=COLUMN[{unit}]'"
    return f"{name} [{unit}]{rate}", option, fit


def _options(unknown: Sequence[tuple[str, str, tuple[str, ...]]]) -> str:
    """The options of `_unknown` signals; columns that suit several of them are told once."""
    told = list[str]()
    for fit in dict.fromkeys(fit for *_, fit in unknown):
        options = [option for _, option, own in unknown if own == fit]
        if fit and len(options) == 1:
            told.append(" or ".join(options[0].replace("COLUMN", column) for column in fit))
        else:
            columns = f", COLUMN being {' or '.join(map(repr, fit))}" if fit else ""
            told.append(" ".join(options) + columns)
    return "; ".join(told)

"""Imports a machine's logs as sessions of a new study; refuses logs of which none can be made."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from msgspec import structs

from rigwatch.physics.engine.equations import Model
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.wire.exchange import ImportMapping, Table, import_file, read_table
from rigwatch.workbench.data import copies, read_columns
from rigwatch.workbench.steps.log_columns import Matched, matched
from rigwatch.workbench.steps.new_files import NewFiles
from rigwatch.workbench.steps.stated_values import stated_values, unused_numbers
from rigwatch.workbench.study import Span


@dataclass(frozen=True)
class Logs:
    """Input of a new study.

    Attributes:
        data: log files: CSV, MAT, Parquet, JSON; or sessions.
        model: a shipped model's name, or a model file.
        healthy: logs of the healthy machine.
        mapping: columns, time and rate, if headers are not sufficient.
        start: known values of the model's parameters, in their units.
        known: values that hold for one log alone, by its file name without suffix.
        stated: parameters whose value each log states, as a single number beside its columns:
            "mass" or "mass[g]".
    """

    data: tuple[Path, ...]
    model: str
    healthy: tuple[Path, ...] = ()
    mapping: ImportMapping = field(default_factory=ImportMapping)
    start: Mapping[str, float] = field(default_factory=dict)
    known: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    stated: Mapping[str, str] = field(default_factory=dict)


def check_names(logs: Logs, model: Model) -> None:
    """Check that all values belong to parameters of the model and are within their bounds.

    Raises:
        ModelError: one is not.
    """
    for values in (logs.start, *logs.known.values()):
        if other := [name for name in values if name not in model.parameters]:
            raise ModelError(f"--set: found {other[0]!r}{nearest(other[0], model.parameters)}")
        for name, value in values.items():
            if broken := model.parameters[name].bounds_broken(value):
                raise ModelError(f"--set: found {name} = {value:g}, expected {broken}")


def check_different(folder: Path, logs: Logs) -> None:
    """Check that no log is a copy of another one.

    Raises:
        ModelError: one is.
    """
    names = [path.name for path in (*logs.data, *logs.healthy)]
    spans = [Span(session=f"{path.stem}.mcap") for path in (*logs.data, *logs.healthy)]
    tables = (read_columns(folder, span) for span in spans)
    if found := copies(dict(zip(names, tables, strict=True))):
        raise ModelError(
            f"found the same samples in {' and '.join(found)}, expected different recordings: what"
            " a model was fitted to is no evidence for it"
        )


def imported(
    files: NewFiles, logs: Logs, model: Model
) -> tuple[Matched, list[str], dict[str, dict[str, float]]]:
    """Imports logs as sessions into the study's folder.

    Returns the columns, remarks, and the parameters that each log states, by its name.

    Raises:
        ImportDataError: a log cannot be read.
        ModelError: two logs have one name, or columns cannot be matched to the model's signals.
    """
    _check_names(logs)
    reading, remarks, stated = None, list[tuple[str, str]](), dict[str, dict[str, float]]()
    for path in (*logs.data, *logs.healthy):
        if path.suffix == ".mcap":
            files.copied(path)
            continue
        table = read_table(path, logs.mapping)
        found = _matched(path, table, logs.mapping, model)
        # A log of a real machine has gaps: missing values are invalid samples, not errors.
        # The model states the unit of a signal, whatever its name stands for elsewhere.
        mapping = structs.replace(
            logs.mapping,
            channels=found.channels,
            time=found.time,
            held=_held(model),
            flag_missing=True,
            any_unit=True,
        )
        made = import_file(path, files.to_write(f"{path.stem}.mcap"), mapping)
        stated[path.stem], of_units = stated_values(table, logs.stated, model)
        unused = unused_numbers(table, logs.stated)
        told = (*found.remarks, *made.remarks[1:], *of_units, *unused)
        remarks += [(path.name, remark) for remark in told]
        reading = reading or found
    return reading or Matched({}, "", {}, ()), _each_once(remarks), stated


def _check_names(logs: Logs) -> None:
    """Raises a `ModelError` if two logs have one name, or a value is given to none of them."""
    names = [path.stem for path in (*logs.data, *logs.healthy)]
    if twice := {name for name in names if names.count(name) > 1}:
        raise ModelError(f"--data: found {min(twice)} twice, expected files of different names")
    if other := [name for name in logs.known if name not in names]:
        raise ModelError(
            f"--set: found log {min(other)!r}{nearest(min(other), dict.fromkeys(names))}"
        )


def _matched(path: Path, table: Table, mapping: ImportMapping, model: Model) -> Matched:
    """The columns of a log that the model's signals are read from; errors name the log."""
    dated = [name for name in table.names if table.states_time(name)]
    given, counted = mapping.channels, mapping.rate is not None
    try:
        return matched(table.names, model, given, mapping.time, dated, counted=counted)
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None


def _held(model: Model) -> tuple[str, ...]:
    """Channels of inputs that the model file calls held from sample to sample."""
    return tuple(o.channel or n for n, o in model.inputs.items() if model.held(n) == "zero")


def _each_once(remarks: list[tuple[str, str]]) -> list[str]:
    """Remarks on logs, each once: those of one machine are mostly alike."""
    logs = dict[str, list[str]]()
    for log, remark in remarks:
        logs.setdefault(remark, []).append(log)
    return [
        f"{names[0] if len(names) == 1 else f'{names[0]} and {len(names) - 1} more'}: {remark}"
        for remark, names in logs.items()
    ]

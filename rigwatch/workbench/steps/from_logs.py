"""Creates a study from a machine's logs and the name of a model.

Logs are imported as sessions in the study's folder and columns are matched to the model's signals.
The study file records the choices: training and held-out parts, sample rate, low-pass.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rigwatch.physics.engine.equations import Input, Model, Output, check_model, model_named
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files import quoted
from rigwatch.wire.units import is_unit, unit_of
from rigwatch.workbench.data import (
    RATES_ALIKE,
    UNFILLED,
    Columns,
    Part,
    form_along_motion,
    predicts_along_motion,
    prepare,
    proposed_low_pass,
    proposed_split,
    read_columns,
    unchanging,
)
from rigwatch.workbench.steps.imported_logs import Logs, check_different, check_names, imported
from rigwatch.workbench.steps.log_columns import Matched
from rigwatch.workbench.steps.new_files import NewFiles
from rigwatch.workbench.study import FILE, LEDGER, Span, Study, check_new, start_study

SAMPLES_PER_PERIOD = 2.5
"""Residual samples kept in a period of the low-pass's corner frequency."""
FEWEST = 200
"""Residual samples that each recording keeps at least."""
EDGE = 15
"""Residual samples left out at both ends, where filters have not settled."""


def study_from_logs(folder: Path, logs: Logs) -> tuple[Study, list[str]]:
    """Create a study; return it with remarks on choices and assumptions.

    Args:
        folder: created if it does not exist.
        logs: recordings and model.

    Raises:
        ConfigError: the folder holds a study already.
        ImportDataError: a log cannot be read.
        ModelError: the model is unknown, or columns cannot be matched to its signals.
    """
    check_new(folder)
    model = model_named(logs.model)
    # Before the logs are read, and with the name of the file that has to be changed.
    check_model(model, logs.model)
    check_names(logs, model)
    with NewFiles(folder) as files:
        reading, remarks, stated = imported(files, logs, model)
        check_different(folder, logs)
        known = {log: values | dict(logs.known.get(log, {})) for log, values in stated.items()}
        logs = replace(logs, known={**logs.known, **known})
        text, choices = _file(files, logs, model, reading)
        for name in (FILE, LEDGER):
            files.to_write(name)
        study = start_study(folder, text)
        told = prepare(study).remarks
    # A horizon is chosen when the study is fitted: what fills none is not known yet.
    if predicts_along_motion(study):
        choices.append(form_along_motion(study.model))
    return study, [*remarks, *choices, *(remark for remark in told if UNFILLED not in remark)]


def _file(files: NewFiles, logs: Logs, model: Model, reading: Matched) -> tuple[str, list[str]]:
    """The text of the study's file, and remarks on its choices."""
    columns = reading.channels | ({"time": reading.time} if reading.time else {})
    spans = [Span(session=f"{path.stem}.mcap") for path in logs.data]
    tables = [read_columns(files.folder, span) for span in spans]
    driving = [n for n in _channels(model.inputs) if n in tables[0].values]
    outputs = [n for n in _channels(model.outputs) if n in tables[0].values]
    train, held_out = proposed_split(tables, driving or outputs, outputs)
    lines = [f"model = {quoted(_named(files, logs.model))}"]
    choices = [f"columns: {_as_read(columns)}"] if columns else []
    rates = [1 / table.dt for table in tables]
    if max(rates) / min(rates) > 1 + RATES_ALIKE:
        lines.append(f"rate = {min(rates):.6g}  # the slowest log's")
    if logs.start:
        lines.append(f"start = {_inline(logs.start)}")
    if units := _of_log(model, reading.channels):
        written = ", ".join(f'{name} = "{unit}"' for name, unit in units.items())
        lines.append(f"shown = {{ {written} }}  # the logs' units")
    if reading.rates:
        added, more = _derive_section(reading, model, tables)
        lines, choices = [*lines, *added], [*choices, *more]
    for use, parts in (("train", train), ("held_out", held_out)):
        for part in parts:
            lines += _span(use, logs.data[part.recording].stem, part, logs)
            still = unchanging(tables[part.recording], driving, part)
            never = f"; {', '.join(still)} never changes there" if still else ""
            choices.append(f"{use.replace('_', ' ')}: {_in_words(logs, part)}{never}")
    for path in logs.healthy:
        choices.append(f"healthy: {path.name}")
        lines += _span("healthy", path.stem, Part(0), logs)
    return "\n".join(lines) + "\n", [
        *choices, *_kept(logs, model), *_not_fitted(logs, model), *_not_held(logs, model)
    ]  # fmt: skip


def _derive_section(
    reading: Matched, model: Model, tables: Sequence[Columns]
) -> tuple[list[str], list[str]]:
    """Lines on the signals that are derived from others, and remarks on them."""
    sources = sorted({channel for channel, _ in reading.rates.values()})
    low_pass = max(proposed_low_pass(tables, name) for name in sources)
    lines = ["", "[derive]", f"low_pass = {low_pass!r}"]
    lines += [
        f'signals.{name} = {{ channel = "{channel}", order = {order} }}'
        for name, (channel, order) in reading.rates.items()
    ]
    choices = [
        f"{', '.join(reading.rates)} made from {', '.join(sources)}, low-passed at {low_pass:g} Hz"
    ]
    lowest_rate = 1 / max(table.dt for table in tables)
    factor = int(lowest_rate / (SAMPLES_PER_PERIOD * low_pass))
    enough = min(map(len, tables)) >= FEWEST * factor
    if factor > 1 and enough and not model.states:
        lines += ["", "[thin]", f"factor = {factor}", f"edge = {EDGE}"]
        choices.append(f"residuals low-passed alike: every {factor}th sample counts")
    return lines, choices


def _kept(logs: Logs, model: Model) -> list[str]:
    """A remark on the parameters that healthy logs alone determine, if there are any."""
    kept = [name for name, p in model.parameters.items() if p.kept and not p.fixed]
    if not (kept and logs.healthy):
        return []
    return [f"{', '.join(kept)}: fitted to the healthy log alone, so that no fault moves it"]


def _not_fitted(logs: Logs, model: Model) -> list[str]:
    """A remark on fixed parameters that keep their values of the model's file, if there are any."""
    given = {*logs.start, *(name for values in logs.known.values() for name in values)}
    fixed = [n for n, p in model.parameters.items() if p.fixed and n not in given]
    if not fixed:
        return []
    differ = f", or --set LOG:{fixed[0]}=VALUE where logs differ" if len(logs.data) > 1 else ""
    return [
        f"{', '.join(fixed)}: not fitted, as the model's file says; give this machine's values with"
        f" --set {fixed[0]}=VALUE{differ}"
    ]


def _not_held(logs: Logs, model: Model) -> list[str]:
    """A remark on values given for parameters that are fitted, if there are any."""
    fitted = [name for name in logs.start if not model.parameters[name].fixed]
    if not fitted:
        return []
    return [
        f"{', '.join(fitted)}: fitted, beginning at the value given; to hold it, set `fixed = true`"
        " in the model's file (`rigwatch model new` copies one that is shipped)"
    ]


def _of_log(model: Model, columns: Mapping[str, str]) -> dict[str, str]:
    """Units of the logs' columns, by output, where the model's file has the SI unit alone."""
    found = {}
    for name, output in model.outputs.items():
        text = columns.get(output.channel or name, "").rpartition("[")[2].rstrip(" ]")
        if is_unit(text) and not output.shown and not unit_of(text).plain:
            found[name] = text
    return found


def _as_read(columns: Mapping[str, str]) -> str:
    """Which column each channel is read from, and in which unit."""
    read = ((channel, *text.rpartition("[")) for channel, text in columns.items())
    return "; ".join(
        f"{channel} from {column.strip()!r} in {unit.rstrip(' ]')}"
        for channel, column, _, unit in read
    )


def _channels(signals: Mapping[str, Input] | Mapping[str, Output]) -> list[str]:
    return [signal.channel or name for name, signal in signals.items()]


def _named(files: NewFiles, model: str) -> str:
    """The model's name, or its file name after copying it into the study."""
    if not model.endswith(".toml"):
        return model
    if Path(model).name == FILE:
        raise ModelError(f"{model}: found the name of the study's own file, expected another one")
    return files.copied(Path(model)).name


def _span(use: str, session: str, part: Part, logs: Logs) -> list[str]:
    lines = ["", f"[[{use}]]", f"session = {quoted(f'{session}.mcap')}"]
    if part.start:
        lines.append(f"start = {part.start:.6g}")
    if part.end != float("inf"):
        lines.append(f"end = {part.end:.6g}")
    if known := logs.known.get(session):
        lines.append(f"parameters = {_inline(known)}")
    return lines


def _inline(values: Mapping[str, float]) -> str:
    """An inline TOML table of numbers by name."""
    return f"{{ {', '.join(f'{name} = {value!r}' for name, value in values.items())} }}"


def _in_words(logs: Logs, part: Part) -> str:
    name = logs.data[part.recording].name
    ends = part.end != float("inf")
    if not (part.start or ends):
        return name
    until = f"to {part.end:.4g} s" if ends else "on"
    # A single log is cut for its split, of several the ends at rest are left out.
    rest = [where for where, left_out in (("before", part.start), ("after", ends)) if left_out]
    why = f", as nothing moves {' or '.join(rest)}" if len(logs.data) > 1 else ""
    return f"{name} from {part.start:.4g} s {until}{why}"

"""Prepares recordings for a model: reads sessions, matches channels, derives velocities.

Invalid and lost samples are NaN. Inputs are interpolated linearly there, since a simulation needs
them everywhere; outputs that are simulated from such an input, up to the end of the window, do not
count. Along the measured motion there are no windows, and those outputs are the motion.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.physics.engine.equations import Input, Model, Output
from rigwatch.physics.engine.fit import Recording, Thinning, ends_of_holes, of_parts
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.workbench.data.columns import Columns, any_same, bridged
from rigwatch.workbench.data.derived_ends import without_ends
from rigwatch.workbench.data.next_rows import with_next_rows
from rigwatch.workbench.data.one_rate import at_own_rates, on_one_rate
from rigwatch.workbench.data.openings import without_openings
from rigwatch.workbench.data.prediction import learns_from_healthy, predicts_along_motion
from rigwatch.workbench.data.recorded_columns import INTERPOLATED, read_columns, with_derived
from rigwatch.workbench.data.signal_units import check_unit
from rigwatch.workbench.data.smeared_steps import beside_steps
from rigwatch.workbench.data.whole_windows import (
    counted_length,
    last_values,
    of_length,
)
from rigwatch.workbench.study import Span, Study, StudyFile

USUAL = 0.5
"""Default horizon [s]."""
UNFILLED = "since they fill no horizon"
"""Words of the remark on ends that are not counted."""
ONE_STEP = ": a further log, or one in which they change more than once"
"""What to do about held-out data without a change, as of a log of one step."""
INVENTED = "without a valid input"
"""Words of the remark on samples at which an input is interpolated."""
SHARED = 2.0
"""Samples that two parts of a session may share, as their ends are rounded."""
MOST_MISSING = 0.2
"""Largest share of samples that may be missing from an input."""


@dataclass(frozen=True, eq=False)
class MotionSensor:
    """A sensor whose reading drives a model along its measured motion.

    Attributes:
        port: port of the unmodified model at which the sensor's effects enter.
        position, rate: columns of the inputs.
        present: column of the input that is 1 where a fault of it is present; None if it is
            everywhere.
    """

    port: str
    position: int
    rate: int
    present: int | None = None


@dataclass(frozen=True, eq=False)
class Data:
    """Training, held-out and healthy recordings of a study.

    Attributes:
        train, held_out: recordings for the model of the study.
        healthy: recording of the healthy rig, None if there is none.
        horizon: samples from one re-initialisation to the next.
        remarks: notes for the user.
        along_motion: whether the recordings are for a model along its measured motion.
        motion: sensors whose position and rate are inputs of that model.
        openings: first samples of held-out recordings, which determine what moves between
            recordings; None if nothing does.
        altered: how the recordings differ from those on which verdicts are calibrated, in words.
    """

    train: Recording
    held_out: Recording
    healthy: Recording | None
    horizon: int
    remarks: tuple[str, ...]
    along_motion: bool = False
    motion: tuple[MotionSensor, ...] = ()
    openings: Recording | None = None
    altered: tuple[str, ...] = ()

    @property
    def of_healthy(self) -> "Data | None":
        """The healthy recording as both training and held-out data; None if there is none."""
        if self.healthy is None:
            return None
        own = self.healthy
        return replace(self, train=own, held_out=own, healthy=None, remarks=(), openings=None)


def prepare(study: Study) -> Data:
    """The recordings of a study, ready to be fitted.

    Raises:
        ModelError: rates differ, a channel is missing, the model is not excited, or too many
            samples are missing.
    """
    file, remarks = study.file, list[str]()
    tables = _with_rates(study, _tables(study, remarks), remarks)
    altered = [word for group in tables.values() for table in group for word in table.altered]
    dt = tables["train"][0].dt
    horizon = max(round(file.horizon / dt) if file.horizon else _usual(tables, dt), 2)
    groups: dict[str, list[Columns]] = _with_known(study, tables)
    held_out = without_openings(study, groups["held_out"], horizon)
    groups["held_out"], groups["openings"], more = held_out
    remarks += more
    made = {
        use: _recording(study, group, horizon, use, remarks) if group else None
        for use, group in groups.items()
    }
    assert made["train"] is not None
    assert made["held_out"] is not None
    if study.horizon_from:
        remarks.append(
            f"horizon {file.horizon:g} s, chosen from {study.horizon_from}; set `horizon` in the"
            " study to override"
        )
    uses = made["train"], made["held_out"], made["healthy"]
    if any(INVENTED in remark for remark in remarks):
        altered.append("inputs are missing")
    unlike = tuple(dict.fromkeys(altered))
    return Data(*uses, horizon, tuple(remarks), openings=made["openings"], altered=unlike)


def _tables(study: Study, remarks: list[str]) -> dict[str, list[Columns]]:
    """The recordings by use, with derived signals."""
    file = study.file
    uses = {"train": file.train, "held_out": file.held_out, "healthy": file.healthy}
    tables = {
        use: [
            replace(
                with_derived(read_columns(study.folder, span), file.derive),
                begun=0.0 if use == "healthy" else _after_first(file, span),
            )
            for span in spans
        ]
        for use, spans in uses.items()
    }
    if any_same(tables["held_out"], tables["train"]):
        remarks.append(
            "held_out: a recording has the same samples as one in training: its error is no"
            " evidence for a model"
        )
    else:
        remarks += _judged_and_fitted(file, tables["held_out"])
    return tables


def _after_first(file: StudyFile, span: Span) -> float:
    """Time of the equations at the start of a part of a session [s].

    It goes on from the part in training to a held-out one. What lies before both does not count: an
    effect has begun with what is explained, not with the session.
    """
    explained = (*file.train, *file.held_out)
    return span.start - min(one.start for one in explained if one.session == span.session)


def _judged_and_fitted(file: StudyFile, held_out: Sequence[Columns]) -> Iterator[str]:
    """Remarks on parts of sessions that are held out and also in training."""
    for span, table in zip(file.held_out, held_out, strict=True):
        for other in file.train:
            first, last = max(span.start, other.start), min(span.end, other.end)
            last = min(last, span.start + len(table) * table.dt)
            if other.session == span.session and last - first > SHARED * table.dt:
                yield (
                    f"held_out: {span.session} from {first:g} to {last:.4g} s is in training, too:"
                    " its error there is no evidence for a model"
                )


def _usual(tables: Mapping[str, Sequence[Columns]], dt: float) -> int:
    """Samples of the default horizon; a tenth of the shortest recording if that is shorter."""
    usual, shortest = round(USUAL / dt), min(len(t) for group in tables.values() for t in group)
    return usual if usual <= shortest else shortest // 10


def _with_known(study: Study, tables: Mapping[str, list[Columns]]) -> dict[str, list[Columns]]:
    """Channels, with the recording's known parameters as further constant channels."""
    spans = {use: getattr(study.file, use) for use in tables}
    return {
        use: [
            _with_recording_parameters(span, table)
            for span, table in zip(spans[use], group, strict=True)
        ]
        for use, group in tables.items()
    }


def _with_recording_parameters(span: Span, table: Columns) -> Columns:
    known = {name: np.full(len(table), value) for name, value in span.parameters.items()}
    return replace(table, values={**table.values, **known})


def _with_rates(
    study: Study, tables: dict[str, list[Columns]], remarks: list[str]
) -> dict[str, list[Columns]]:
    """The recordings at their own rates, or at one if the study needs that."""
    spans = (*study.file.train, *study.file.held_out, *study.file.healthy)
    whole = [table for group in tables.values() for table in group]
    names = [span.session for span in spans]
    if not _needs_one_rate(study):
        remarks += at_own_rates(whole, names)
        return tables
    kept = frozenset(
        study.file.channel_of(name, own)
        for name, own in study.model.inputs.items()
        if study.model.held(name) == "zero"
    )
    made, said = on_one_rate(whole, names, study.file.rate, kept)
    remarks += said
    rest = iter(made)
    return {use: [next(rest) for _ in group] for use, group in tables.items()}


def _needs_one_rate(study: Study) -> bool:
    """Whether a study asks for a rate, or counts in samples what all recordings share.

    That is a smoothing of the measured motion, a decimation, a period, or a healthy remainder.
    """
    file = study.file
    counts = file.rate or file.thin or file.period or study.model.rough
    return bool(counts) or predicts_along_motion(study)


def _recording(
    study: Study, tables: Sequence[Columns], horizon: int, use: str, remarks: list[str]
) -> Recording:
    """Parts joined in sequence, each of whole windows so that no window spans two parts."""
    inputs, outputs, beyond = [], [], list[float]()
    smeared = np.zeros(len(study.model.outputs), np.int64)
    for table in tables:
        length = counted_length(study, len(table), horizon)
        if length == 0:
            raise ModelError(
                f"{use}: found {len(table)} samples, expected at least one horizon of {horizon}"
                f" ({horizon * table.dt:g} s); give a shorter `horizon` in the study's file"
            )
        if length < len(table):
            beyond.append((len(table) - length) * table.dt)
        u, y = _matched(study, table)
        if INTERPOLATED in table.altered:
            beside = beside_steps(study.model, u)
            y, smeared = np.where(beside, np.nan, y), smeared + beside.sum(axis=0)
        inputs.append(of_length(length, u, filler=last_values(u)))
        outputs.append(of_length(length, without_ends(study, y, table.dt), filler=np.nan))
    if beyond:
        share = sum(beyond) / sum(len(table) * table.dt for table in tables)
        remarks.append(_beyond(use, beyond, share, horizon * tables[0].dt))
    remarks += [
        f"{use}: {count} samples of {name} beside steps of an input are not counted, as samples are"
        " interpolated there"
        for name, count in zip(study.model.outputs, smeared, strict=True)
        if count
    ]
    thin = study.file.thin
    parts = tuple(len(u) for u in inputs)
    thinning = Thinning(thin.factor, thin.edge, parts) if thin else None
    u, y = np.concatenate(inputs), np.concatenate(outputs)
    breaks = ends_of_holes(u)
    u, y = _without_holes(study, u, y, horizon, use=use, remarks=remarks)
    if use != "openings":
        _check_excitation(study.model, u, use)
    ends = [name for name, held in study.holds.items() if held.ends]
    passed = min(table.passed for table in tables)
    dt, spacings = of_parts([table.dt for table in tables], parts)
    derived = tuple(
        tables[0].derived.get(study.file.channel_of(name, output))
        for name, output in study.model.outputs.items()
    )
    made = Recording(
        dt, u, y, thinning, parts, passed=passed, breaks=breaks, spacings=spacings,
        begun=tuple(table.begun for table in tables), derived=derived,
    )  # fmt: skip
    return with_next_rows(study.model, made, ends)


def _beyond(use: str, spans: Sequence[float], share: float, horizon: float) -> str:
    """The remark on ends of recordings that fill no horizon; all times in seconds.

    `share` is that of all samples.
    """
    which = f"{spans[0]:.3g} s of a recording"
    if len(spans) > 1:
        which = f"{min(spans):.3g} to {max(spans):.3g} s of {len(spans)} recordings"
    return (
        f"{use}: the last {which} are not counted, {UNFILLED} of {horizon:g} s; {1 - share:.1%} of"
        " the samples are used"
    )


def _matched(study: Study, table: Columns) -> tuple[FloatArray, FloatArray]:
    model = study.model

    def column(name: str, signal: Input | Output) -> FloatArray:
        wanted = study.file.channel_of(name, signal)
        if wanted not in table.values:
            raise ModelError(
                f"{model.name}: found no channel {wanted!r} for {name}"
                f"{nearest(wanted, table.values)}"
            )
        check_unit(
            table.units.get(wanted, ""), signal, f"channel {wanted!r}", f"{model.name}: {name}"
        )
        return table.values[wanted]

    u = [column(name, signal) for name, signal in model.inputs.items()]
    y = [column(name, signal) for name, signal in model.outputs.items()]
    return np.stack(u, axis=1) if u else np.zeros((len(table), 0)), np.stack(y, axis=1)


def _without_holes(
    study: Study, u: FloatArray, y: FloatArray, horizon: int, *, use: str, remarks: list[str]
) -> tuple[FloatArray, FloatArray]:
    """Inputs without gaps, and outputs without those that are simulated from an invented input."""
    model = study.model
    missing = np.asarray(~np.isfinite(u).all(axis=1))
    for index, name in enumerate(model.inputs):
        share = float(np.mean(~np.isfinite(u[:, index])))
        if share > MOST_MISSING:
            raise ModelError(
                f"{use}: found {share:.0%} of input {name!r} missing or invalid, expected at most"
                f" {MOST_MISSING:.0%}"
            )
    for index, name in enumerate(model.outputs):
        if not np.isfinite(y[:, index]).any():
            raise ModelError(f"{use}: found no valid sample of output {name!r}")
    if not missing.any():
        return u, y
    driven = predicts_along_motion(study) or learns_from_healthy(study)
    runs_on = bool(model.states) and not driven
    lost = _to_the_windows_end(missing, horizon) if runs_on else missing
    remark = f"{use}: {int(missing.sum())} samples {INVENTED} are not counted"
    if after := int(lost.sum() - missing.sum()):
        remark += f", nor {after} that the model runs through before its next initialisation"
    remarks.append(remark)
    if not np.isfinite(y[~lost]).any(axis=0).all():
        raise ModelError(
            f"{use}: found {int(missing.sum())} samples {INVENTED}, so that no horizon of"
            f" {horizon} samples counts; expected a recording with fewer gaps or a shorter horizon"
        )
    filled = np.stack([bridged(column) for column in u.T], axis=1)
    return filled, np.where(lost[:, None], np.nan, y)


def _to_the_windows_end(missing: BoolArray, horizon: int) -> BoolArray:
    """Samples from the first missing one of each window on."""
    rows = missing.reshape(-1, horizon)
    return np.asarray(np.maximum.accumulate(rows, axis=1).reshape(-1))


def _check_excitation(model: Model, u: FloatArray, use: str) -> None:
    driving = model.driving()
    u = u[:, [name in driving for name in model.inputs]]
    if u.size and not np.any(np.ptp(u, axis=0) > 1e-12 * np.maximum(np.abs(u).max(axis=0), 1e-300)):
        raise ModelError(
            f"{use}: found inputs {', '.join(driving)} that never change, expected a recording"
            f" with excitation{ONE_STEP if use == 'held_out' else ''}"
        )


def parameters_of(file: StudyFile) -> dict[str, float]:
    """Initial values of the model and the accepted effects, by the system's names."""
    found = dict(file.start)
    for accepted in file.effects:
        prefix = f"{accepted.port}_{accepted.effect}_"
        found |= {prefix + name: value for name, value in accepted.parameters.items()}
    # The last effect stores the whole fit with which it was accepted.
    return found | dict(file.effects[-1].model if file.effects else {})

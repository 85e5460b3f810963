"""Whether the training recordings excite the model, and if not, a split that does.

Recordings at rest, or steps cut off before their transient, leave model parameters undetermined.
Such parameters take arbitrary values, so the held-out error is no evidence for an effect. Before
anything is ranked every parameter's interval is checked. If one is undetermined, other splits of
the same recordings are tried, and one that determines it is proposed. A parameter too small to show
is as good as known: if another split gives it a size that the training rules out, it only stands in
there for what the model lacks.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from msgspec import structs

from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import Data, prepare
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.fit import NO_INFLUENCE, Value, fit_base, fit_model, shown, values
from rigwatch.workbench.ranking import Ranked
from rigwatch.workbench.study import Span, Study

UNDETERMINED, DETERMINED = 1.0, 0.25
"""Half-width of an interval over its value: above the first a parameter counts as undetermined,
below the second as determined."""
SUITS = 1.05
"""Ratio of training errors up to which the training allows another split's values."""
SHARES = (0.5, 2 / 3)
"""Shares of each recording tried as training data."""


def unexcited(bench: Bench) -> Verdict | None:
    """The verdict if another split determines parameters that the training data do not."""
    undetermined = {n: v for n, v in _own(bench).items() if _width(v) > UNDETERMINED}
    in_memory = len(bench.data.train.parts) != len(bench.study.file.train)
    # A split decides which recordings have values of their own, so another is another model.
    fixed_split = in_memory or bench.data.along_motion or bench.study.moving()
    if not undetermined or fixed_split or bench.study.model.rough:
        return None
    for study in _splits(bench.study, bench.data):
        found, judged = _values(study, bench)
        determined = found and all(_width(found[name]) < DETERMINED for name in undetermined)
        told = determined and all(_width(judged[name]) < UNDETERMINED for name in undetermined)
        if told and _suits(bench, {name: found[name].value for name in undetermined}):
            before = ", ".join(f"{name} = {shown(value)}" for name, value in undetermined.items())
            after = ", ".join(f"{name} = {shown(found[name])}" for name in undetermined)
            train, held_out = _spans_text(study.file.train), _spans_text(study.file.held_out)
            text = (
                f"the training does not excite the model ({before}); train on {train} and hold out"
                f" {held_out}, which gives {after}"
            )
            return Verdict("model_inadequate", None, (), (), text)
    return None


def cannot_tell(bench: Bench, rows: Sequence[Ranked], verdict: Verdict) -> Verdict:
    """`model_inadequate` if no effect was accepted on a fit that determines no parameter at all.

    A fit that leaves all of them open follows what is missing, and so hides it: in windows of a
    minute a block that warms for ten minutes is any ramp. That no effect helps there says nothing.
    """
    accepted = any(row.accepted for row in rows)
    if verdict.word != "unknown_effect" or accepted or not bench.base.determines_nothing:
        return verdict
    free = bench.base.compiled.system.free
    text = (
        f"the training determines none of {', '.join(free)}, so that what is missing cannot be"
        " told; record longer, or more changes of the inputs, or give what is known with --set"
    )
    return Verdict("model_inadequate", None, (), (), text)


def with_unjudged_told(bench: Bench, verdict: Verdict) -> Verdict:
    """The verdict; `nothing_missing` with the parameters of which that says nothing.

    Along the measured motion states drive the model that a free run would have to predict, and what
    acts on them alone shows in no output.
    """
    if verdict.word != "nothing_missing" or not bench.data.along_motion:
        return verdict
    idle = [name for name, one in _own(bench).items() if one.note == NO_INFLUENCE]
    if not idle:
        return verdict
    text = (
        f"; along the measured motion no output depends on {', '.join(idle)}, which is not judged:"
        ' `prediction = "free"` in the study asks for a free run'
    )
    return replace(verdict, text=verdict.text + text)


def _own(bench: Bench) -> dict[str, Value]:
    """The model's free parameters with their intervals from the training fit."""
    known = bench.study.model.parameters
    return {n: v for n, v in values(bench.base.train).items() if n in known and v.interval}


def _width(value: Value) -> float:
    """Half-width of the interval over the value."""
    assert value.interval is not None
    low, high = value.interval
    return (high - low) / 2 / max(abs(value.value), 1e-300)


def _suits(bench: Bench, told: Mapping[str, float]) -> bool:
    """Whether the training has hardly a larger error with these values of parameters."""
    own, base = bench.study.model.parameters, bench.base
    held = {name: structs.replace(own[name], value=at, fixed=True) for name, at in told.items()}
    study = replace(bench.study, model=structs.replace(bench.study.model, parameters=own | held))
    start = base.train.values() | dict(told)
    try:
        found = fit_model(study, bench.data, base.placements, start, base.train.scale, base=base)
    except RigwatchError:
        return False
    return found.train_error <= SUITS * base.train_error


def _values(study: Study, bench: Bench) -> tuple[dict[str, Value], dict[str, Value]]:
    """Model parameters fitted to each side of another split; empty if the fit fails."""
    try:
        data = prepare(study)
        fitted = fit_base(study, data, bench.base.train.scale)
    except RigwatchError:
        return {}, {}
    train, held_out = (
        {name: value for name, value in values(side).items() if value.interval}
        for side in (fitted.train, fitted.held_out)
    )
    return train, held_out


def _splits(study: Study, data: Data) -> Iterator[Study]:
    """The study with other splits of the same recordings into training and held-out parts."""
    train, held = study.file.train, study.file.held_out
    whole = _whole(_ending(train, data.train) + _ending(held, data.held_out))
    tries = [(list(held), list(train))]
    for share in SHARES:
        at = [round(span.start + share * (span.end - span.start), 2) for span in whole]
        first = [structs.replace(s, end=end) for s, end in zip(whole, at, strict=True)]
        last = [structs.replace(s, start=begin) for s, begin in zip(whole, at, strict=True)]
        tries += [(first, last), (last, first)]
    for fitted, judged in tries:
        file = structs.replace(study.file, train=tuple(fitted), held_out=tuple(judged))
        yield replace(study, file=file)


def _ending(spans: Sequence[Span], recording: Recording) -> list[Span]:
    """Spans with finite ends [s]."""
    lengths = zip(spans, recording.parts, strict=True)
    return [
        structs.replace(s, end=min(s.end, s.start + length * recording.dt)) for s, length in lengths
    ]


def _whole(spans: Sequence[Span]) -> list[Span]:
    """One span per session, from the start of its first part to the end of its last."""
    names = dict.fromkeys(span.session for span in spans)
    groups = [[span for span in spans if span.session == name] for name in names]
    return [
        structs.replace(group[0], start=min(s.start for s in group), end=max(s.end for s in group))
        for group in groups
    ]


def _spans_text(spans: Sequence[Span]) -> str:
    def part(span: Span) -> str:
        end = "its end" if span.end == float("inf") else f"{span.end:.4g} s"
        return f"{span.session} from {span.start:.4g} s to {end}"

    return ", ".join(part(span) for span in spans)

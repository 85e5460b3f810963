"""Results of the workbench as plain text: tables and sentences."""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bases, Comparison, Region
from rigwatch.workbench.explain import Explanation, Row
from rigwatch.workbench.fit import Value, error_text, shown
from rigwatch.workbench.steps import Change
from rigwatch.workbench.study import FILE, GIVEN, Held, told

VERDICTS = {
    "nothing_missing": "nothing is missing",
    "missing_effect": "an effect is missing",
    "undetermined": "undetermined: the recordings do not decide",
    "unknown_effect": "something is missing that no known effect explains",
    "model_inadequate": "the model is inadequate for this recording: no effect is named",
}
BEYOND = (
    "the recordings ask for the bound's value or one beyond it, and the interval does not hold"
    " there; if the bound is the machine's own, the model may lack something"
)
"""What it means that a parameter is on a bound."""
OF_ALL = (
    "× channel noise: the error of each channel over the noise of its training recordings, as the"
    " root mean square of all channels"
)
"""What the unit of an error of several channels means."""
MOST_ROWS = 12
"""Rows of a printed ranking; `--json` has all."""
MOST_RIVALS = 2
"""Rivals whose commands are printed; the verdict's sentence has all."""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of aligned columns; numbers are right-aligned."""
    whole = [list(head), *map(list, rows)]
    wide = [max(len(row[i]) for row in whole) for i in range(len(head))]
    right = [all(_numeric(row[i]) for row in rows) for i in range(len(head))]
    return [
        "  "
        + "  ".join(
            cell.rjust(w) if r else cell.ljust(w)
            for cell, w, r in zip(row, wide, right, strict=True)
        ).rstrip()
        for row in whole
    ]


def _numeric(text: str) -> bool:
    return not text or text[0].isdigit() or text in ("-", "< 1e-6") or text[0] in "-+<"


def number(value: float | None) -> str:
    """A number with four significant digits."""
    return "-" if value is None else f"{value:.4g}"


def comparison_lines(found: Comparison) -> list[str]:
    """What `rigwatch compare` prints."""
    heading = "effects: " + (", ".join(found.effects) or "none yet")
    rows = [
        [
            name,
            c.told_in,
            *(number(c.told(e)) for e in (c.train_error, c.held_out_error, c.noise_floor)),
        ]
        for name, c in found.channels.items()
    ]
    if len(rows) > 1:
        total = (found.train_error, found.held_out_error, found.noise_floor)
        rows.append(["all", found.told_in, *map(number, total)])
    lines = [heading, "", "error (root mean square)"]
    lines += table(["channel", "unit", "training", "held out", "noise floor"], rows)
    lines += [
        f"  one free run over all held-out data: {name} {number(c.told(c.free_run_error))}"
        f" {c.told_in}"
        for name, c in found.channels.items()
        if c.free_run_error is not None
    ]
    lines += [f"  noise floor from {found.noise_from}", *fit_lines(found)]
    lines += ["", "parameters, 95 % interval"]
    lines += table(["name", "value", "interval", "unit", ""], _parameters(found.parameters))
    return lines + [f"note: {remark}" for remark in found.remarks]


def _channel_lines(found: Comparison) -> list[str]:
    """The error of each of several channels in its own unit."""
    if len(found.channels) < 2:
        return []
    lines = [
        f"  {name}: held out {number(c.told(c.held_out_error))} {c.told_in},"
        f" noise floor {number(c.told(c.noise_floor))} {c.told_in}"
        for name, c in found.channels.items()
    ]
    return [*lines, f"  {OF_ALL}"]


def fit_lines(found: Comparison) -> list[str]:
    """Holds of the inputs and convergence of the fit."""
    lines = [f"  input {name}: {_held(held)}" for name, held in found.hold.items()]
    ended = found.convergence
    if ended is None:
        return lines
    word = "converged" if ended.converged else "did not converge"
    lines += [f"  the fit {word}: {ended.reason}"]
    for names, what in (
        (ended.undetermined, "the data do not determine"),
        (ended.at_bound, "on a bound:"),
    ):
        lines += [f"  {what} {', '.join(names)}"] if names else []
    return lines + ([f"    {BEYOND}"] if ended.at_bound else [])


def _held(held: Held) -> str:
    """An input's hold between samples, in words."""
    what = "held from sample to sample" if held.hold == "zero" else "linear between samples"
    if held.ends:
        what += ", recorded a sample late: a row has the value of the interval that ends there"
    elif held.late:
        time = f" ({1e3 * held.seconds:.3g} ms)" if held.seconds else ""
        what += f", {held.late:.2g} of a sample late{time}"
    if held.source in GIVEN:
        return f"{what}, given by {held.source}"
    return f"{what}, chosen from {held.source}"


def _parameters(found: dict[str, Value]) -> list[list[str]]:
    return [[name, number(v.value), _interval(v), v.unit, v.note] for name, v in found.items()]


def _interval(value: Value) -> str:
    if value.interval is None:
        return "held"
    return f"{value.interval[0]:.4g} … {value.interval[1]:.4g}"


def explanation_lines(found: Explanation) -> list[str]:
    """What `rigwatch explain` prints."""
    base = found.comparison
    lines = [
        f"verdict: {headline(found)}",
        f"  {found.text}",
        f"  {doubt_of(found)}",
        *_named_lines(found),
        "",
        f"now: training {base.told(base.train_error):.4g},"
        f" held out {base.told(base.held_out_error):.4g},"
        f" noise floor {base.told(base.noise_floor):.4g} {base.told_in}",
        *_channel_lines(base),
        f"  noise floor from {base.noise_from}",
        *fit_lines(base),
        "",
        f"ranking ({len(found.ranking)} effects at ports)",
    ]
    errors = [f"training [{base.told_in}]", "held out", "p", "", "cannot be told from"]
    lines += table(
        ["effect@port", *errors], [_ranked(row, base) for row in found.ranking[:MOST_ROWS]]
    )
    if found.next_experiment:
        lines += ["", f"next experiment: {found.next_experiment.text}"]
    return lines + [f"note: {remark}" for remark in base.remarks]


def headline(found: Explanation) -> str:
    """The verdict in a few words, how much more is missing, and what else to know of its effect."""
    return VERDICTS[found.verdict] + more_missing(found) + at_its_bounds(found)


def more_missing(found: Explanation) -> str:
    """How much more than the effect that it names is missing, in words; empty if nothing is."""
    if found.verdict != "missing_effect" or not found.remains:
        return ""
    return (
        f", and more than that: it leaves {found.remains:.0%} of the error's energy, for which no"
        " known effect is found yet"
    )


def at_its_bounds(found: Explanation) -> str:
    """That the effect which a verdict names is at an end of its own bounds; empty if it is not."""
    if found.verdict != "missing_effect" or not found.on_bound:
        return ""
    own = found.ranking[0].parameters
    values = [f"{name} ({shown(replace(own[name], interval=None))})" for name in found.on_bound]
    ends = "is on a bound" if len(values) == 1 else "are on bounds"
    return f"; its {' and '.join(values)} {ends}: the recordings may ask for another shape"


def _named_lines(found: Explanation) -> list[str]:
    """The fitted parameters of the effect that the verdict names, and of those beside it."""
    if found.verdict != "missing_effect" or not found.ranking:
        return []
    best = found.ranking[0]
    label = f"{best.effect}@{best.port}"
    named = {label: found.together.get(label, best.parameters), **found.together}
    told = [(label, _fitted(own)) for label, own in named.items()]
    return [f"  {label}: {'; '.join(fitted)}" for label, fitted in told if fitted]


def _fitted(parameters: dict[str, Value]) -> list[str]:
    """Those that were fitted, with their intervals."""
    return [
        f"{name} = {shown(value)}{f', {value.note}' if value.note else ''}"
        for name, value in parameters.items()
        if value.interval is not None
    ]


def next_command(found: Explanation, study: str) -> str:
    """The command that adds the effect that the verdict names; empty if it names none.

    Args:
        found: the explanation.
        study: the study's folder, as on the command line.
    """
    if found.verdict != "missing_effect" or not found.ranking:
        return ""
    return _adding(found, found.ranking[0], study)


def _adding(found: Explanation, row: Row, study: str) -> str:
    """The command that adds an effect, beside those without which it is refused."""
    others = f" --with {' '.join(found.beside)}" if found.beside else ""
    return f"rigwatch add {study} {row.effect} --port {row.port}{others}"


def next_step(found: Explanation, study: str) -> str:
    """What to do after an explanation; empty if nothing is named or the text says it.

    Args:
        found: the explanation.
        study: the study's folder, as on the command line.
    """
    if found.verdict == "unknown_effect":
        return _where_to_look(found, study)
    if found.verdict != "undetermined" or not found.ranking:
        return next_command(found, study)
    best = found.ranking[0]
    what = "record that experiment" if found.next_experiment else "record another motion"
    use, anyway = ("train", "") if best.accepted or found.beside else ("held_out", " --anyway")
    ways = [
        f"{row.effect}@{row.port}: {_adding(found, row, study)}{anyway}"
        for row in (best, *_rivals_to_add(found))
    ]
    return (
        f"{what}, list it under [[{use}]] in {study}/{FILE}, and explain again; or, if you know"
        f" that it is {'; if it is '.join(ways)}"
    )


def _where_to_look(found: Explanation, study: str) -> str:
    """What to do where no known effect explains the error; empty if the text offers an exchange.

    The best effect may be one of several that are missing, which the recordings cannot confirm.
    """
    if found.exchange is not None:
        return ""
    best = found.ranking[0] if found.ranking else None
    look = (
        f"rigwatch locate {study} shows where the model fails; an effect of your own is tried with"
        f" rigwatch add {study} --effect-file FILE"
    )
    if best is None or not best.accepted:
        return look
    return (
        f"{look}; or, if you know that {best.effect}@{best.port} is a part of it:"
        f" {_adding(found, best, study)}"
    )


def _rivals_to_add(found: Explanation) -> list[Row]:
    """The first rivals that `add` takes in the same way as the best effect.

    A rival that is refused alone may belong to a set, and one that is offered in place of the last
    accepted effect has its commands in the text.
    """
    best, offer = found.ranking[0], found.exchange
    known = {f"{best.effect}@{best.port}", *found.beside}
    known |= {f"{offer.effect}@{offer.port}"} if offer else set()
    rows = {f"{row.effect}@{row.port}": row for row in found.ranking}
    rivals = [rows[name] for name in found.rivals if name in rows and name not in known]
    taken = [row for row in rivals if row.accepted == best.accepted or found.beside]
    return taken[:MOST_RIVALS]


def doubt_of(found: Explanation) -> str:
    """How often similar verdicts were wrong on simulated cases, in a sentence."""
    cases, wrong = found.like_this
    if found.unlike:
        return f"the probability of being wrong is unknown: {found.unlike}, unlike simulated cases"
    if not cases:
        return "the probability of being wrong is unknown: no simulated case is similar to this one"
    kind = (
        "verdicts on simulated logs with such faults"
        if found.altered
        else "similar simulated cases"
    )
    were = f"of {cases} {kind} {wrong} {'was' if wrong == 1 else 'were'} wrong"
    if found.wrong_at_most is None:
        return f"the probability of being wrong is unknown: {were}, which are too few"
    return f"probability of being wrong at most {found.wrong_at_most:.1%}: {were}"


def _ranked(row: Row, base: Comparison) -> list[str]:
    mark = "accepted" if row.accepted else row.reason
    p = "< 1e-6" if row.p_value < 1e-6 else f"{row.p_value:.1g}"
    errors = [
        _error(row.train_error, base.train_error, base),
        _error(row.held_out_error, base.held_out_error, base),
    ]
    return [f"{row.effect}@{row.port}", *errors, p, mark, ", ".join(row.class_[:3])]


def _error(error: float | None, known: float, where: Comparison) -> str:
    """An error in the unit in which it is told; "diverges" if it is far beyond the known one."""
    return error_text(None if error is None else where.told(error), where.told(known))


def change_lines(found: Change) -> list[str]:
    """What `rigwatch add` and `undo` print."""
    rows = [["before", *_errors(found.before)]]
    if found.tried and found.step == "refused":
        known = (found.before.train_error, found.before.held_out_error)
        tried = [_error(*each, found.before) for each in zip(found.tried, known, strict=True)]
        rows.append([f"with {found.effect}", *tried])
    else:
        rows.append(["after", *_errors(found.after)])
    lines = [found.text, ""]
    lines += table([f"error [{found.after.told_in}]", "training", "held out"], rows)
    if found.step != "refused":
        lines += ["", "parameters, 95 % interval"]
        lines += table(
            ["name", "value", "interval", "unit", ""], _parameters(found.after.parameters)
        )
    return lines


def _errors(found: Comparison) -> list[str]:
    return [number(found.told(error)) for error in (found.train_error, found.held_out_error)]


def base_lines(found: Bases) -> list[str]:
    """What `rigwatch study base` prints."""
    head = ["variants", "training", "held out", "over noise", "parameters"]
    rows = [
        [
            ", ".join(base.variants) or "none",
            *map(number, (base.train_error, base.held_out_error, base.over_noise)),
            str(base.parameters),
        ]
        for base in found.ranking[:MOST_ROWS]
    ]
    enough = found.enough
    lines = [f"healthy recordings, error in noise standard deviations ({len(found.ranking)} bases)"]
    lines += [*table(head, rows), ""]
    lines += [
        f"enough: {', '.join(enough.variants) or 'the unmodified model'}, with a held-out error of"
        f" {enough.over_noise:.3g} times the noise"
    ]
    lines += [f"  {enough.reason}"] if enough.variants else []
    return lines + [f"note: {remark}" for remark in found.remarks]


def region_lines(found: Sequence[Region], most: int) -> list[str]:
    """What `rigwatch locate` prints: for each view the regions with the most energy."""
    lines = []
    for channel, view in dict.fromkeys((r.channel, r.view) for r in found):
        regions = [r for r in found if (r.channel, r.view) == (channel, view)][:most]
        unit = regions[0].told_in
        rows = [
            [
                r.name,
                *(number(told(value, unit) if unit else value) for value in (r.rms, r.mean)),
                f"{r.share:.0%}",
                _span(r),
            ]
            for r in regions
        ]
        lines += [f"{channel}{f' [{unit}]' if unit else ''}, by {view}"]
        lines += [*table(["where", "rms", "mean", "share of energy", "samples"], rows), ""]
    return lines[:-1]


def _span(region: Region) -> str:
    if not len(region.samples):
        return ""
    return f"{len(region.samples)}, first {region.samples[0]}, last {region.samples[-1]}"


def region_data(found: Sequence[Region]) -> list[dict[str, object]]:
    """What `rigwatch locate --json` prints."""
    whole = [{name: getattr(r, name) for name in r.__dataclass_fields__} for r in found]
    return [row | {"samples": r.samples.tolist()} for row, r in zip(whole, found, strict=True)]

"""Tries a step on a study: adding an effect to its model, or removing the last one.

A trial fits but writes nothing, so it can be cancelled at any time. Its commit writes the study's
file and the ledger's line, both or neither.

An effect that does not lower the held-out error is refused. A lower training error is no evidence,
since every further parameter lowers it. An effect that is refused alone may be supported together
with others that are not in the model yet: these are named, and the whole set is fitted and judged.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from msgspec import structs

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.score import suits
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.workbench.compare import (
    Bench,
    Comparison,
    Warm,
    fitted_beside_healthy,
    with_hold_of,
)
from rigwatch.workbench.explain import SetGain, set_gain
from rigwatch.workbench.fit import error_text, fit_model
from rigwatch.workbench.ranking import (
    Progress,
    Ranked,
    accepted_from,
    leaves_only_noise,
    neutral_strength,
    no_progress,
    rank_only,
    refit_from_given,
    refit_nested,
    refutes_neutral,
    shapes_of,
    vanishes,
)
from rigwatch.workbench.steps.kept_holds import with_kept_holds
from rigwatch.workbench.study import (
    REFUSED,
    Accepted,
    Study,
    commit,
    drop_effect,
    refusal,
    stands_on,
    use_variants,
)

WORSE = 1.01
"""Largest ratio of the refit's held-out error to the accepted fit's at which both are the same."""
KEPT = 0.9
"""Smallest share of the accepted fit's gain that a refit must keep. Parameters that come from a
healthy recording are determined anew with the effect; a short one leaves them a little loose."""


@dataclass(frozen=True)
class Change:
    """Outcome of a step.

    Attributes:
        step: "add", "refused" or "undo".
        effect, port: names of the effect and its port.
        before, after: the model before and after the step; the same if it was refused.
        tried: training and held-out error with the effect; None for "undo".
        text: summary in one sentence.
    """

    step: str
    effect: str
    port: str
    before: Comparison
    after: Comparison
    tried: tuple[float, float] | None
    text: str


@dataclass(frozen=True)
class Trial:
    """A step that has been tried but not yet written.

    Attributes:
        before: the study as opened.
        after: the study after the step; unchanged if the step is refused.
        change: outcome of the step.
        line: the ledger's entry.
        step: the ledger's name of the step, if different from that of `change`.
    """

    before: Study
    after: Study
    change: Change
    line: dict[str, Any]
    step: str = ""

    def commit(self) -> Change:
        """Write study and ledger, both or neither; return the change.

        Raises:
            ModelError: the study has been changed since it was opened.
        """
        commit(self.before, self.after, self.step or self.change.step, **self.line)
        return self.change


def try_add(
    study: Study,
    effect: str,
    port: str | None = None,
    *,
    anyway: bool = False,
    beside: Sequence[str] = (),
    progress: Progress = no_progress,
    warm: Warm | None = None,
) -> Trial:
    """Try `add` without writing anything; can be cancelled at any time.

    Args:
        study, effect, port, anyway, beside: as for `add`.
        progress: called with a line of text as each part begins.
        warm: cache of fits; new fits are added to it.

    Raises:
        ModelError: effect or port is unknown or already there, or the fit fails.
    """
    warm = warm or Warm()
    effect, where = _placed(study, effect, port)
    others = _others(study, f"{effect}@{where}", beside)
    progress("fitting the current model")
    before = warm.comparison(study)
    bench, row = _tried_with_hold(study, effect, where, progress, warm)
    assert row.fitted is not None
    found = row.fitted.held_out_error
    in_set = _in_set(bench, row, others, progress)
    if in_set is not None and in_set.reason:
        row = replace(row, reason=f"{row.reason}; {in_set.reason}")
    supported = row.accepted or (in_set is not None and not in_set.reason)
    if not (supported or anyway):
        words = f"{_falls(row, before, found)}: {row.reason}"
        return _refused(study, row, others, before, words)
    accepted = accepted_with_model(row)
    progress(f"refitting with {row.label}")
    changed = with_kept_holds(study, accepted, bench, warm)
    after = warm.comparison(changed)
    again = after.held_out_error
    if supported and not keeps_gain(before.held_out_error, found, again, after.noise_floor):
        supported, row = False, replace(row, reason=f"refitted, it leaves {_told(again, after)}")
        if not anyway:
            words = f"{_falls(row, before, found)}, but {row.reason}"
            return _refused(study, row, others, before, words)
    line: dict[str, Any] = {
        "parameters": accepted.parameters,
        "model_parameters": accepted.model,
        "ahead": accepted.ahead,
        "beyond": accepted.beyond,
    }
    line |= _evidence(in_set) | ({} if supported else {"reason": f"added anyway: {row.reason}"})
    errors, text = (after.train_error, again), _falls(row, before, again)
    text = f"{text}; {in_set.text(before.told_in)}" if in_set is not None else text
    text += _no_longer_needed(warm.bench(changed))
    change = Change("add", effect, where, before, after, errors, text)
    return Trial(study, changed, change, _which(change) | line | _numbers(after))


def _others(study: Study, label: str, beside: Sequence[str]) -> list[str]:
    """The other effects of a set, as "effect@port".

    Raises:
        ModelError: one is unknown, in the model already, or named twice.
    """
    found = ["@".join(_placed(study, each)) for each in beside]
    if len({label, *found}) <= len(found):
        raise ModelError(f"{label}: found with {' '.join(found)}, expected each effect once")
    return found


def _in_set(bench: Bench, row: Ranked, others: Sequence[str], progress: Progress) -> SetGain | None:
    """The set's evidence for an effect that is refused alone; None without a set."""
    if row.accepted or not others:
        return None
    progress(f"fitting {row.label} with {', '.join(others)}")
    return set_gain(bench, row.label, others)


def _evidence(found: SetGain | None) -> dict[str, Any]:
    """What the ledger keeps of the set that an effect was accepted in."""
    if found is None:
        return {}
    errors = {"without_held_out_error": found.without, "held_out_error": found.held_out_error}
    return {"set": {"with": list(found.others), **errors}}


def _falls(row: Ranked, before: Comparison, after: float) -> str:
    at_first, then = before.told(before.held_out_error), before.told(after)
    error = f"{error_text(then, at_first)} {before.told_in}"
    return f"{row.label}: held-out error {at_first:.4g} → {error}"


def _no_longer_needed(bench: Bench) -> str:
    """Earlier effects whose strength is neutral beside the new one, in words; empty without one."""
    own, found = bench.base, []
    for count, placement in enumerate(reversed(own.placements[:-1]), start=2):
        strength = neutral_strength(own.train, placement)
        if strength is not None and not _needed(bench, placement):
            found.append(
                f"; {placement.label} is no longer needed ({strength}): to take it"
                f" out, `rigwatch undo {bench.study.folder}` {count} times, then add what came"
                " after it"
            )
    return "".join(found)


def _needed(bench: Bench, placement: Placement) -> bool:
    """Whether the training refutes the model without an effect of open strength.

    That without it is the same as it at its neutral strength, if nothing of it is left there.
    """
    own = bench.base
    if not vanishes(placement.effect):
        return False
    others = [each for each in own.placements if each is not placement]
    its = {placement.prefix + name for name in placement.effect.parameters}
    begin = {name: value for name, value in own.train.values().items() if name not in its}
    try:
        without = fit_model(bench.study, bench.data, others, begin, own.train.scale)
    except ModelError:
        return True
    return refutes_neutral(without.train, own.train, placement.effect)


def _told(error: float, where: Comparison) -> str:
    return f"{where.told(error):.4g} {where.told_in}"


def keeps_gain(before: float, accepted: float, again: float, floor: float) -> bool:
    """Whether a refit keeps the gain of the accepted fit, or ends below the noise floor.

    Args:
        before, accepted, again: held-out errors without the effect, with it, and refitted with it.
        floor: the noise floor, in the same unit.
    """
    return again <= max(WORSE * accepted, before - KEPT * (before - accepted), floor)


def try_undo(study: Study, progress: Progress = no_progress, warm: Warm | None = None) -> Trial:
    """Try `undo` without writing anything.

    Raises:
        ModelError: there is nothing to undo.
    """
    warm = warm or Warm()
    if not study.file.effects and study.file.variants:
        return _as_written(study, progress, warm)
    if not study.file.effects:
        raise ModelError(f"{study.folder}: found no effect to undo")
    last = study.file.effects[-1]
    after = drop_effect(study)
    change = _without(study, after, (last.effect, last.port), progress, warm)
    return Trial(study, after, change, _which(change) | _numbers(change.after))


def _as_written(study: Study, progress: Progress, warm: Warm) -> Trial:
    """The trial of removing all variants of the model."""
    named = ", ".join(study.file.variants)
    after = use_variants(study, ())
    change = _without(study, after, (named, ""), progress, warm)
    line = {"variants": [], "before": list(study.file.variants), **_numbers(change.after)}
    return Trial(study, after, change, line, step="base")


def _without(
    study: Study, after: Study, what: tuple[str, str], progress: Progress, warm: Warm
) -> Change:
    """The undo step from `study` to `after`; `what` is effect and port."""
    label = "@".join(filter(None, what))
    progress("fitting the current model")
    before = warm.comparison(study)
    progress(f"fitting without {label}")
    found = warm.comparison(after)
    errors = f"{before.told(before.held_out_error):.4g} → {_told(found.held_out_error, found)}"
    text = f"{label} removed: held-out error {errors}"
    return Change("undo", *what, before, found, None, text)


def _which(change: Change) -> dict[str, Any]:
    return {"effect": change.effect, "port": change.port}


def try_effect(
    study: Study, effect: str, port: str, progress: Progress = no_progress, warm: Warm | None = None
) -> Ranked:
    """Fit an effect at a port and judge it by the held-out error.

    Raises:
        ModelError: effect or port is unknown or already there, or the fit fails.
    """
    where = _port(study, effect, port)
    return _tried_with_hold(study, effect, where, progress, warm or Warm())[1]


def _tried_with_hold(
    study: Study, effect: str, port: str, progress: Progress, warm: Warm
) -> tuple[Bench, Ranked]:
    """The effect as judged, and the bench that it is judged on.

    A hold chosen without the effect may stand for all of it. So where the effect is refused beside
    that hold, it is judged beside the one that the recordings show with the effect in the model.
    """
    bench = warm.bench(study)
    progress(f"fitting {effect}@{port}")

    def tried() -> tuple[Bench, Ranked]:
        row = _tried(bench, effect, port)
        other = None if row.accepted else with_hold_of(bench, row.placement)
        if other is None or not (again := _tried(other, effect, port)).accepted:
            return bench, row
        return other, again

    return warm.get((effect, port, stands_on(study)), tried)


def accepted_with_model(row: Ranked) -> Accepted:
    """The effect as an entry of the study's file, with the model's values fitted beside it."""
    assert row.fitted is not None
    own, fit = accepted_from(row), row.fitted.train
    known = {row.placement.prefix + name for name in own.parameters}
    free = set(fit.compiled.system.free) - known
    rest = {name: value for name, value in fit.values().items() if name in free}
    return structs.replace(own, model=rest)


def _refused(
    study: Study, row: Ranked, others: Sequence[str], before: Comparison, words: str
) -> Trial:
    assert row.fitted is not None
    errors = (row.fitted.train_error, row.fitted.held_out_error)
    tried: dict[str, Any] = {"tried_train_error": errors[0], "tried_held_out_error": errors[1]}
    words = f"{words}; not added"
    change = Change(REFUSED, row.effect, row.port, before, before, errors, words)
    told = _which(change) | tried | refusal(study, others)
    return Trial(study, study, change, {"reason": row.reason} | _numbers(before) | told)


def _numbers(found: Comparison) -> dict[str, object]:
    return {
        "train_error": found.train_error,
        "held_out_error": found.held_out_error,
        "noise_floor": found.noise_floor,
        "unit": found.unit,
    }


def _placed(study: Study, effect: str, port: str | None = None) -> tuple[str, str]:
    """Name and port of `effect` or `effect@port`.

    Raises:
        ModelError: effect or port is unknown or already there, or two ports are given.
    """
    name, _, named = effect.partition("@")
    if named and port and named != port:
        raise ModelError(f"add: found {effect} with --port {port}, expected one port")
    return name, _port(study, name, named or port)


def _port(study: Study, name: str, port: str | None) -> str:
    effect, ports = study.effect(name), study.model.ports
    fitting = [n for n, place in ports.items() if suits(effect, place, study.model)]
    if port is None:
        if len(fitting) == 1:
            return fitting[0]
        found = "none" if not fitting else "several: " + ", ".join(fitting)
        raise ModelError(
            f"{name}: found {found} of the model's ports for it, expected one (--port)"
        )
    if port not in ports:
        raise ModelError(f"{name}: found no port {port!r}{nearest(port, ports)}")
    if port not in fitting:
        expected = ", ".join(fitting) or "another model"
        raise ModelError(f"{name}: not compatible with port {port!r}, expected {expected}")
    if any(a.effect == name and a.port == port for a in study.file.effects):
        raise ModelError(f"{name}@{port}: found in the model already")
    return port


def _tried(bench: Bench, effect: str, port: str) -> Ranked:
    found = shapes_of(bench.study, bench.data.train, effect, port)
    row = rank_only(bench.study, bench.data, bench.base, found)
    refit_nested(bench.study, bench.data, bench.base, [row])
    if row.fitted is None:
        raise ModelError(f"{row.label}: cannot be fitted: {row.failure}")
    if leaves_only_noise(bench.study, bench.data, bench.floor, row):
        return row
    refit_from_given(bench.study, bench.data, bench.base, row)
    shared = fitted_beside_healthy(bench, row)
    return row if shared is None else shared[1]

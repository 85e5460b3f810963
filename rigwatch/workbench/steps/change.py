"""Adds an effect to a study's model, or takes the last one away again; the ledger keeps both.

An effect under which the held-out error does not fall is refused: that the training error falls is
no evidence, as every further parameter lets it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msgspec import structs

from rigwatch.physics.engine.equations import Placement, compose, load_effects
from rigwatch.physics.engine.score import suits
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench, Comparison, comparison, open_bench
from rigwatch.workbench.fit import held_as
from rigwatch.workbench.ranking import Ranked, accepted_from, candidates, rank_only, refit
from rigwatch.workbench.study import (
    Accepted,
    Study,
    append,
    append_effect,
    drop_effect,
    keep_holds,
    nearest,
    use_effect_file,
)

WORSE = 1.01
"""Held-out error over that of the accepted fit up to which a fit once more has led back to it."""


@dataclass(frozen=True)
class Change:
    """What a step did.

    Attributes:
        step: "add", "refused" or "undo".
        effect, port: which one.
        before, after: the model without and with the step; the same where it was refused.
        tried: errors that a refused effect would have led to: training, held out.
        text: in a sentence.
    """

    step: str
    effect: str
    port: str
    before: Comparison
    after: Comparison
    tried: tuple[float, float] | None
    text: str


def add(study: Study, effect: str, port: str | None = None, *, anyway: bool = False) -> Change:
    """Put an effect into the model, if the recordings held out speak for it.

    Args:
        study: the study.
        effect: its name.
        port: where; may be left out where only one port takes it.
        anyway: add it even though the held-out error does not fall.

    Raises:
        ModelError: effect or port is unknown or already there, or the fit fails.
    """
    where = _port(study, effect, port)
    bench = open_bench(study)
    # What is chosen now stays, so that errors before and after are of the same inputs.
    study = held_as(study, bench.study.holds)
    row = _tried(bench, effect, where)
    before = comparison(bench)
    assert row.fitted is not None
    errors = (row.fitted.train_error, row.fitted.held_out_error)
    words = (
        f"{row.label}: held-out error {before.held_out_error:.4g} → {errors[1]:.4g} {before.unit}"
    )
    if not row.accepted and not anyway:
        return _refused(study, row, before, f"{words}: {row.reason}")
    accepted = _whole(row)
    # Before the file is touched, so that a model that fails leaves the study as it is.
    after = comparison(open_bench(study.with_effects([*study.file.effects, accepted])))
    if after.held_out_error > WORSE * errors[1] and not anyway:
        row.reason = f"fitted once more it leaves {after.held_out_error:.4g} {after.unit}"
        return _refused(study, row, before, f"{words}, but {row.reason}")
    changed = append_effect(keep_holds(study), accepted)
    numbers = _numbers(after) | {"model_parameters": accepted.model}
    append(changed, "add", effect=effect, port=where, parameters=accepted.parameters, **numbers)
    return Change("add", effect, where, before, after, errors, words)


def _whole(row: Ranked) -> Accepted:
    """The effect as a study's file lists it, with the values of the whole fit beside its own."""
    assert row.fitted is not None
    own, fit = accepted_from(row), row.fitted.train
    free = set(fit.compiled.system.free)
    rest = {
        name: value
        for name, value in fit.values().items()
        if name in free and not name.startswith(row.placement.prefix)
    }
    return structs.replace(own, model=rest)


def _refused(study: Study, row: Ranked, before: Comparison, words: str) -> Change:
    assert row.fitted is not None
    errors = (row.fitted.train_error, row.fitted.held_out_error)
    tried: dict[str, Any] = {"tried_train_error": errors[0], "tried_held_out_error": errors[1]}
    numbers = _numbers(before) | tried
    append(study, "refused", effect=row.effect, port=row.port, reason=row.reason, **numbers)
    return Change("refused", row.effect, row.port, before, before, errors, f"{words}; not added")


def learn(study: Study, path: Path) -> tuple[Study, list[str]]:
    """Take the user's effect file into the study; its effects' names.

    Raises:
        ConfigError: the file does not fit.
        ModelError: an effect fits none of the model's ports.
    """
    found = load_effects(path)
    for name, effect in found.items():
        places = [n for n, p in study.model.ports.items() if effect.fits(p.kind)]
        if not places:
            raise ModelError(
                f"{path}: {name}: found port {effect.port!r}, expected one that"
                f" {study.model.name} has"
            )
        compose(study.model, [Placement(name, effect, places[0])])
    changed = use_effect_file(study, path)
    append(changed, "effect-file", file=path.name, names=sorted(found))
    return changed, sorted(found)


def undo(study: Study) -> Change:
    """Take the last effect away.

    Raises:
        ModelError: there is none.
    """
    if not study.file.effects:
        raise ModelError(f"{study.folder}: found no effect to undo")
    last = study.file.effects[-1]
    before = comparison(open_bench(study))
    changed = drop_effect(study)
    after = comparison(open_bench(changed))
    append(changed, "undo", effect=last.effect, port=last.port, **_numbers(after))
    text = f"{last.effect}@{last.port} taken away: held-out error {before.held_out_error:.4g} →"
    text = f"{text} {after.held_out_error:.4g} {after.unit}"
    return Change("undo", last.effect, last.port, before, after, None, text)


def _numbers(found: Comparison) -> dict[str, object]:
    return {
        "train_error": found.train_error,
        "held_out_error": found.held_out_error,
        "noise_floor": found.noise_floor,
        "unit": found.unit,
    }


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
        raise ModelError(f"{name}: cannot stand at port {port!r}, expected {expected}")
    if any(a.effect == name and a.port == port for a in study.file.effects):
        raise ModelError(f"{name}@{port}: found in the model already")
    return port


def _tried(bench: Bench, effect: str, port: str) -> Ranked:
    found = [
        c for c in candidates(bench.study, bench.data.train) if (c.name, c.port) == (effect, port)
    ]
    row = rank_only(bench.study, bench.data, bench.base, found)
    refit(bench.study, bench.data, bench.base, row)
    if row.fitted is None:
        raise ModelError(f"{row.label}: cannot be fitted: {row.trouble}")
    return row

"""Ranks every effect at every port: scored along the fitted model, the best fitted and judged.

The score test asks all candidates at once which of them the residual looks like, with what has been
fitted already taken out. Its p-value allows for residuals that hang together, as those of a wrong
model do, and is corrected for the number of candidates. The best are then fitted in full, and the
recordings held out decide: an effect counts only if their error falls, block by block, by more
than chance would do.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from rigwatch.physics.engine.equations import EffectParameter, Placement
from rigwatch.physics.engine.fit import Recording, windows
from rigwatch.physics.engine.score import (
    ALIKE,
    Candidate,
    Projector,
    Scores,
    corrected_p_values,
    directions,
    possible,
    score,
    shaped,
    suits,
    trajectory,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, NoiseFloor, port_sizes
from rigwatch.workbench.fit import (
    Fitted,
    block_errors,
    fit_again,
    fit_model,
    fit_twice,
    may_be_better,
    nodes,
)
from rigwatch.workbench.ranking.recordings import check_ports, part_by_part
from rigwatch.workbench.study import Accepted, Study

LEVEL = 0.01
"""Corrected p-value below which an effect is worth a fit."""
MATERIAL = 0.03
"""Share by which the held-out error must fall at least to be worth an effect."""
STEP = 0.025
"""One-sided level at which the held-out error must fall."""
SAME = 0.9995
"""Cosine above which two effects are one, whatever they are called."""
SIMILAR = 0.8
"""Cosine below which two effects explain different parts of the error."""
EXPLAINED = 0.95
"""Share of the energy above the floor that an effect must explain for the error to be known."""
AGAIN = 0.25
"""Share of the energy above the floor that an effect must explain to first order to be fitted once
more, where its fit may have ended in a local minimum."""
MOST_FITS = {"static": 24, "dynamic": 6}
Progress = Callable[[str], None]
Fitting = Callable[..., Fitted]


def unheard(_: str) -> None:
    """Progress that nobody asked for."""


@dataclass(eq=False)
class Ranked:
    """One effect at one port.

    Attributes:
        placement: which one, and where.
        kind: of the port: force, actuator or sensor.
        p_value: of the score, corrected for the number of candidates.
        explained: share of the residual's energy in training that it explains to first order.
        start: values that its fit starts from.
        alike: effects whose effect on this recording is nearly parallel, as "effect@port".
        cosines: with every other effect, by its label.
        turned: the same with a sign: negative where both explain the residual in opposite ways.
        fitted: with it in the model; None where it was not worth a fit or the fit failed.
        gain: fall of the held-out mean squared error, None without a fit.
        gain_deviation: standard deviation of `gain`.
        accepted: whether the held-out error falls by more than chance.
        reason: in words.
        trouble: why it cannot be fitted, empty where it can.
    """

    placement: Placement
    kind: str
    p_value: float
    explained: float
    start: dict[str, float]
    alike: list[str]
    cosines: dict[str, float]
    turned: dict[str, float]
    fitted: Fitted | None = None
    gain: float | None = None
    gain_deviation: float | None = None
    accepted: bool = False
    reason: str = "not like the residual"
    trouble: str = ""

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return self.placement.name

    @property
    def port(self) -> str:
        """Where it may be missing."""
        return self.placement.port

    @property
    def free(self) -> int:
        """Parameters that a fit of it moves."""
        return self.placement.effect.free

    @property
    def label(self) -> str:
        """Effect and port in one word."""
        return f"{self.effect}@{self.port}"

    def begin(self, share: float = 1.0) -> dict[str, float]:
        """Values that its fit starts from, by the system's names: a share of its strength alone."""
        effect, values = self.placement.effect, dict(self.start)
        p = effect.parameters[effect.strength]
        values[effect.strength] = _within(p, share * (values[effect.strength] - p.neutral))
        return {self.placement.prefix + name: value for name, value in values.items()}

    @property
    def held_out_error(self) -> float:
        """Held-out error with it, infinite without a fit."""
        return self.fitted.held_out_error if self.fitted else float("inf")


def candidates(study: Study, recording: Recording) -> list[Candidate]:
    """Every effect at every port where it makes sense and does not stand yet."""
    check_ports(study)
    sizes = port_sizes(study.model, recording)
    placed = {(a.effect, a.port) for a in study.file.effects}
    return [
        candidate
        for port, place in study.model.ports.items()
        for name, effect in study.effects.items()
        if (name, port) not in placed and suits(effect, place, study.model)
        for candidate in shaped(name, study.effect_at(name, port).scaled(sizes[port]), port)
    ]


def score_all(data: Data, base: Fitted, found: Sequence[Candidate]) -> Scores:
    """Scores of all candidates along the fitted base model.

    Args:
        data, base: the model and what it was fitted to.
        found: the candidates.
    """
    fitted, recording = base.train, data.train
    cut = windows(base.compiled.system, len(recording), base.horizon)
    moved, slopes = part_by_part(_along, data, base, found)
    measured = np.isfinite(recording.outputs)[cut.starts[:, None] + np.arange(cut.length)]
    moved, slopes = moved * measured[..., None], slopes * measured[..., None]
    if recording.thinning:
        moved, slopes = recording.thinning.apply(moved), recording.thinning.apply(slopes)
    flat = (len(cut.starts), -1)
    moved = moved.reshape(*flat, len(found))
    slopes = slopes.reshape(*flat, slopes.shape[-1])
    m = len(base.compiled.system.free)
    residual = np.nan_to_num(fitted.residuals / fitted.scale).reshape(flat)
    fixed = Projector(slopes[..., :m], slopes[..., m:])
    return score(residual, moved, fixed, float(np.mean(residual**2)))


def _along(data: Data, base: Fitted, found: Sequence[Candidate]) -> tuple[FloatArray, FloatArray]:
    """Scaled directions of the candidates and slopes of the model, at every sample."""
    fitted, recording = base.train, data.train
    cut = windows(base.compiled.system, len(recording), base.horizon)
    substeps = nodes(base, recording)
    at = trajectory(
        base.compiled, recording.inputs, recording.dt, cut.starts, cut.length,
        initial=fitted.initial, parameters=fitted.parameters, substeps=substeps,
    )  # fmt: skip
    run = base.compiled.simulate(
        recording.inputs, recording.dt, cut.starts, cut.length,
        initial=fitted.initial, parameters=fitted.parameters, substeps=substeps,
    )  # fmt: skip
    scale = fitted.scale[:, None]
    return directions(at, found) / scale, run.slopes / scale


def rank(
    study: Study,
    data: Data,
    base: Fitted,
    floor: NoiseFloor,
    progress: Progress = unheard,
) -> list[Ranked]:
    """All effects at all ports, the best first; those worth it fitted and judged.

    Args:
        study, data, base: the model and what it was fitted to.
        floor: of the held-out recordings.
        progress: told which fit begins.
    """
    rows = _scored(study, data, base, candidates(study, data.train))
    kind = "dynamic" if study.model.states else "static"
    chosen = _worth_a_fit(rows, kind)
    enough = _fit_each(study, data, base, floor, chosen, progress)
    if not enough:
        least = AGAIN * floor.above(base.train)
        likely = [row for row in chosen if row.explained > least]
        _try_again(study, data, base, likely, progress)
    while double := _unfitted_double(rows, floor):
        progress(f"fitting {double.label}, which looks like the best")
        refit(study, data, base, double, fit_model if enough else fit_twice)
    return sorted(rows, key=_order)


def _fit_each(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    base: Fitted,
    floor: NoiseFloor,
    rows: Sequence[Ranked],
    progress: Progress,
) -> list[Ranked]:
    """Fit rows in turn; those that leave nothing, after which only what is like them is fitted."""
    enough: list[Ranked] = []
    for number, row in enumerate(rows, start=1):
        if any(other.cosines[row.label] < SIMILAR for other in enough):
            row.reason = f"unlike {enough[0].label}, which explains {EXPLAINED:.0%}; not fitted"
            continue
        progress(f"fitting {row.label}, {number} of at most {len(rows)}")
        refit(study, data, base, row, fit_model)
        if row.accepted and _leaves_nothing(row, base, floor):
            enough.append(row)
    return enough


def _try_again(
    study: Study, data: Data, base: Fitted, rows: Sequence[Ranked], progress: Progress
) -> None:
    """Fit again what may have ended in a local minimum, as nothing explains the error."""
    for row in rows:
        start = base.train.values() | row.begin()
        if row.fitted is None or not may_be_better(study, data, row.fitted, start):
            continue
        progress(f"fitting {row.label} again, by way of short horizons")
        row.fitted = fit_again(study, data, row.fitted, start)
        judge_fit(base, row)


def _unfitted_double(rows: Sequence[Ranked], floor: NoiseFloor) -> Ranked | None:
    """What looks like the best to first order and was not fitted: only its fit shows whether.

    One that looks the same altogether is fitted only where the best leaves more than noise.
    """
    accepted = [row for row in rows if row.accepted]
    if not accepted:
        return None
    best = min(accepted, key=_order)
    waiting = {row.label: row for row in rows if row.fitted is None and not row.trouble}
    alike = (waiting[label] for label in best.alike if label in waiting)
    assert best.fitted is not None
    enough = floor.reached(best.fitted.held_out)
    return next((row for row in alike if best.cosines[row.label] <= SAME or not enough), None)


def _leaves_nothing(row: Ranked, base: Fitted, floor: NoiseFloor) -> bool:
    """Whether it explains so much of the error above the floor that only its like could as well."""
    return left_over(base, row, floor) < 1 - EXPLAINED


def left_over(base: Fitted, row: Ranked, floor: NoiseFloor, *, tolerant: bool = False) -> float:
    """Share of the error above the floor that a row leaves, but for samples at which it jumps."""
    assert row.fitted is not None
    before, after = base.held_out, row.fitted.held_out
    return floor.left_over(before, after, row.fitted.calm, tolerant=tolerant)


def rank_all(study: Study, data: Data, base: Fitted) -> list[Ranked]:
    """Every effect at every port by its score, none of them fitted."""
    return _scored(study, data, base, candidates(study, data.train), every=True)


def rank_only(study: Study, data: Data, base: Fitted, found: Sequence[Candidate]) -> Ranked:
    """The row of one effect at one port, whatever its score; `found` are its shapes."""
    return _scored(study, data, base, found, every=True)[0]


def _scored(
    study: Study, data: Data, base: Fitted, found: Sequence[Candidate], *, every: bool = False
) -> list[Ranked]:
    """One row an effect and port, scored and not yet fitted, the likeliest first."""
    scores = score_all(data, base, found)
    residual = np.nan_to_num(base.train.residuals / base.train.scale).ravel()
    p_values = corrected_p_values(scores, residual, len(base.train.residuals))
    return _best_shapes(study, found, scores, p_values, every=every)


def _best_shapes(
    study: Study,
    found: Sequence[Candidate],
    scores: Scores,
    p_values: FloatArray,
    *,
    every: bool,
) -> list[Ranked]:
    """One row an effect and port, with the shape that the residual looks like most."""
    best: dict[tuple[str, str], int] = {}
    for index, candidate in enumerate(found):
        if not every and not possible(candidate, float(scores.strength[index])):
            continue
        key = (candidate.name, candidate.port)
        if key not in best or scores.score[index] > scores.score[best[key]]:
            best[key] = index
    rows, signs = [], np.sign(scores.strength)
    chosen = list(best.values())
    turned = (scores.units[:, chosen] * signs[chosen]).T @ (scores.units[:, chosen] * signs[chosen])
    for at, ((name, port), index) in enumerate(best.items()):
        others = {f"{n}@{p}": j for j, (n, p) in enumerate(best) if j != at}
        signed = {label: float(turned[at, j]) for label, j in others.items()}
        cosines = {label: abs(cosine) for label, cosine in signed.items()}
        alike = [label for label, cosine in cosines.items() if cosine > ALIKE]
        candidate = found[index]
        rows.append(
            Ranked(
                Placement(name, candidate.effect, port), study.model.ports[port].kind,
                float(p_values[index]),
                float(scores.explained[index]), _start(candidate, float(scores.strength[index])),
                alike, cosines, signed,
            )
        )  # fmt: skip
    return sorted(rows, key=lambda row: -row.explained)


def _start(candidate: Candidate, strength: float) -> dict[str, float]:
    p = candidate.effect.parameters[candidate.effect.strength]
    return {**candidate.shape, candidate.effect.strength: _within(p, strength)}


def _within(p: EffectParameter, strength: float) -> float:
    """Where the fit of an effect of this strength begins."""
    return 1.0 if p.role == "switch" else float(np.clip(p.neutral + strength, p.low, p.high))


def _worth_a_fit(rows: Sequence[Ranked], kind: str) -> list[Ranked]:
    """The best, and the best of each kind of port, that the residual looks like beyond chance."""
    likely = [row for row in rows if row.p_value < LEVEL]
    told: dict[str, Ranked] = {}
    for row in likely:
        double = _told_by(row, told, likely)
        if double is None:
            told[row.label] = row
            row.reason = "explains less than others; not fitted"
        else:
            row.reason = f"looks like {double}; not fitted"
    chosen = list(told.values())[: MOST_FITS[kind]]
    for port_kind in ("force", "actuator", "sensor"):
        first = next((row for row in told.values() if row.kind == port_kind), None)
        if first is not None and first not in chosen:
            chosen.append(first)
    return chosen


def _told_by(row: Ranked, told: dict[str, Ranked], likely: Sequence[Ranked]) -> str | None:
    """What is fitted in the row's place: a double of no more parameters, or of lower order."""
    lower = f"{row.placement.effect.refines}@{row.port}"
    if lower in row.alike and any(other.label == lower for other in likely):
        return lower
    return next((c for c in row.alike if c in told and told[c].free <= row.free), None)


def refit(
    study: Study, data: Data, base: Fitted, row: Ranked, fitting: Fitting = fit_twice
) -> None:
    """Fit the model with the row's effect and judge it on the recordings held out.

    Args:
        study, data, base: the model and what it was fitted to.
        row: the effect; the fit and what is made of it are added.
        fitting: `fit_model` to be content with the first minimum.
    """
    placements, start = (*base.placements, row.placement), base.train.values() | row.begin()
    try:
        row.fitted = fitting(study, data, placements, start, base.train.scale, base=base)
    except ModelError as error:
        row.reason, row.trouble = "cannot be fitted", str(error)
        return
    judge_fit(base, row)


def judge_fit(base: Fitted, row: Ranked) -> None:
    """Say whether the held-out error falls by more than chance."""
    assert row.fitted is not None
    row.gain, row.gain_deviation = gain(base, row.fitted)
    count = len(block_errors(base.held_out))
    needed = student.ppf(1 - STEP, count - 1) * row.gain_deviation
    fall = 1 - row.held_out_error / base.held_out_error
    row.accepted = bool(row.gain > max(needed, 0.0) and fall > MATERIAL)
    row.reason = _said(row.gain, needed, row.accepted)


def _said(gained: float, needed: float, accepted: bool) -> str:
    if accepted:
        return "held-out error falls"
    if gained <= 0:
        return "held-out error rises"
    if gained <= needed:
        return "held-out error falls no more than by chance"
    return f"held-out error falls by less than {MATERIAL:.0%}"


def gain(base: Fitted, other: Fitted) -> tuple[float, float]:
    """Fall of the held-out mean squared error from `base` to `other`, and its deviation."""
    difference = block_errors(base.held_out) - block_errors(other.held_out)
    return float(difference.mean()), float(difference.std(ddof=1) / np.sqrt(len(difference)))


def accepted_from(row: Ranked) -> Accepted:
    """The row as a study's file lists it, its fit's values to start from."""
    assert row.fitted is not None
    prefix = row.placement.prefix
    values = {
        name[len(prefix) :]: value
        for name, value in row.fitted.train.values().items()
        if name.startswith(prefix)
    }
    return Accepted(effect=row.effect, port=row.port, parameters=values)


def _order(row: Ranked) -> tuple[int, float, float]:
    return (
        0 if row.accepted else 1 if row.fitted else 2,
        row.held_out_error if row.fitted else 0.0,
        -row.explained,
    )

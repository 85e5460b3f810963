"""Ranks every effect at every port: scored along the fitted model, the best fitted and judged.

The score test asks all candidates at once which of them the residual looks like, with what has been
fitted already taken out. Its p-value allows for residuals that hang together, as those of a wrong
model do, and is corrected for the number of candidates. The best are then fitted in full, and the
recordings held out decide: an effect counts only if their error falls, block by block, by more
than chance would do.
"""

import ast
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import chi2
from scipy.stats import t as student

from rigwatch.physics.engine.compiled import FloatArray
from rigwatch.physics.engine.directions import RATE, Candidate, directions, shaped, trajectory
from rigwatch.physics.engine.effect import Effect
from rigwatch.physics.engine.fit import Recording, windows
from rigwatch.physics.engine.model import Model, Port
from rigwatch.physics.engine.score import ALIKE, Projector, Scores, score
from rigwatch.physics.engine.system import Placement
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.fitted import Fitted, block_errors, fit_model
from rigwatch.workbench.signals import Data
from rigwatch.workbench.sizes import port_sizes
from rigwatch.workbench.study import Accepted, Study

LEVEL = 0.01
"""Corrected p-value below which an effect is worth a fit."""
MATERIAL = 0.03
"""Share by which the held-out error must fall at least to be worth an effect."""
STEP = 0.025
"""One-sided level at which the held-out error must fall."""
MOST_FITS = {"static": 24, "dynamic": 6}


@dataclass(eq=False)
class Ranked:
    """One effect at one port.

    Attributes:
        effect, port: which one.
        kind: of the port: force, actuator or sensor.
        p_value: of the score, corrected for the number of candidates.
        explained: share of the residual's energy in training that it explains to first order.
        start: values that its fit starts from.
        alike: effects whose effect on this recording is nearly parallel, as "effect@port".
        cosines: with every other effect, by its label.
        fitted: with it in the model; None where it was not worth a fit or the fit failed.
        gain: fall of the held-out mean squared error, None without a fit.
        gain_deviation: standard deviation of `gain`.
        accepted: whether the held-out error falls by more than chance.
        reason: in words.
        trouble: why it cannot be fitted, empty where it can.
    """

    effect: str
    port: str
    kind: str
    p_value: float
    explained: float
    start: dict[str, float]
    alike: list[str]
    cosines: dict[str, float]
    fitted: Fitted | None = None
    gain: float | None = None
    gain_deviation: float | None = None
    accepted: bool = False
    reason: str = "not like the residual"
    trouble: str = ""
    placement: Placement | None = field(default=None, repr=False)

    @property
    def label(self) -> str:
        """Effect and port in one word."""
        return f"{self.effect}@{self.port}"

    @property
    def held_out_error(self) -> float:
        """Held-out error with it, infinite without a fit."""
        return self.fitted.held_out_error if self.fitted else float("inf")


def candidates(study: Study, recording: Recording) -> list[Candidate]:
    """Every effect at every port where it makes sense and does not stand yet."""
    sizes = port_sizes(study.model, recording)
    placed = {(a.effect, a.port) for a in study.file.effects}
    return [
        candidate
        for port, place in study.model.ports.items()
        for name, effect in study.effects.items()
        if (name, port) not in placed and suits(effect, place, study.model)
        for candidate in shaped(name, effect.scaled(sizes[port]), port)
    ]


def suits(effect: Effect, port: Port, model: Model) -> bool:
    """Whether the effect can stand at the port and finds all that its equations name there."""
    if not effect.fits(port.kind):
        return False
    if effect.states and port.kind != "force" and not model.states:
        return False
    texts = [effect.expression, *(s.derivative for s in effect.states.values())]
    used = {n.id for text in texts for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Name)}
    functions = {
        n.func.id
        for text in texts
        for n in ast.walk(ast.parse(text))
        if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)
    }
    own = {*effect.parameters, *effect.states, "t", RATE, *({"u"} if port.kind != "force" else ())}
    return used - functions - own <= set(port.variables)


def score_all(
    data: Data, base: Fitted, found: Sequence[Candidate], variance: float | None
) -> Scores:
    """Scores of all candidates along the fitted base model.

    Args:
        data, base: the model and what it was fitted to.
        found: the candidates.
        variance: of the scaled residuals where nothing is missing; theirs as they are if None.
    """
    fitted, recording = base.train, data.train
    cut = windows(base.compiled.system, len(recording), base.horizon)
    moved, slopes = _along(data, base, found)
    measured = np.isfinite(recording.outputs)[cut.starts[:, None] + np.arange(cut.length)]
    moved, slopes = moved * measured[..., None], slopes * measured[..., None]
    if recording.thinning:
        moved, slopes = recording.thinning.apply(moved), recording.thinning.apply(slopes)
    flat = (len(cut.starts), -1)
    moved = moved.reshape(*flat, len(found))
    slopes = slopes.reshape(*flat, slopes.shape[-1])
    m = len(base.compiled.system.free)
    residual = np.nan_to_num(fitted.residuals / fitted.scale).reshape(flat)
    if variance is None:
        variance = float(np.mean(residual**2))
    return score(residual, moved, Projector(slopes[..., :m], slopes[..., m:]), variance)


def _along(data: Data, base: Fitted, found: Sequence[Candidate]) -> tuple[FloatArray, FloatArray]:
    """Scaled directions of the candidates and slopes of the model, at every sample."""
    fitted, recording = base.train, data.train
    cut = windows(base.compiled.system, len(recording), base.horizon)
    substeps = base.substeps if base.compiled.system.states else 1
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


def corrected_p_values(scores: Scores, residual: FloatArray, windows_: int) -> FloatArray:
    """p-values of the scores where residuals hang together, corrected for all candidates.

    The variance of a sum of products of two series is larger than that of white noise by
    Σ_k ρr(k)·ρd(k) (M. S. Bartlett, 1946), with the autocorrelations ρ of the direction and of
    the residual that is left without the candidate.

    Args:
        scores: of the candidates.
        residual: scaled, what the scores are of, shape (samples,).
        windows_: windows that the samples come from.
    """
    shape = (windows_, -1, scores.units.shape[1])
    along = scores.units.T @ residual
    left = residual[:, None] - scores.units * along
    own, other = (
        _autocorrelation(left.reshape(shape)),
        _autocorrelation(scores.units.reshape(shape)),
    )
    swollen = np.maximum(1.0, own[0] * other[0] + 2 * np.sum(own[1:] * other[1:], axis=0))
    spread = np.maximum(np.sum(left**2, axis=0), 1e-300) / max(len(residual) - 1, 1)
    alone = chi2.sf(along**2 / (spread * swollen), 1)
    tests = max(int(np.sum(scores.score > 0)), 1)
    return np.asarray(-np.expm1(tests * np.log1p(-np.minimum(alone, 1 - 1e-16))))


def _autocorrelation(signals: FloatArray) -> FloatArray:
    """Over the windows of (windows, samples, k), tapered, up to a quarter of a window."""
    count = signals.shape[1]
    spectrum = np.fft.rfft(signals, 2 * count, axis=1)
    power = np.mean(np.abs(spectrum) ** 2, axis=0)
    together = np.fft.irfft(power, axis=0)[: max(min(count // 4, 200), 1)]
    taper = 1 - np.arange(len(together)) / len(together)
    start = np.where(together[0] > 0, together[0], 1.0)
    return np.asarray(together / start * taper[:, None])


def rank(study: Study, data: Data, base: Fitted, variance: float | None = None) -> list[Ranked]:
    """All effects at all ports, the best first; those worth it fitted and judged."""
    found = candidates(study, data.train)
    scores = score_all(data, base, found, variance)
    residual = np.nan_to_num(base.train.residuals / base.train.scale).ravel()
    p_values = corrected_p_values(scores, residual, len(base.train.residuals))
    rows = _best_shapes(study, found, scores, p_values)
    for row in _worth_a_fit(rows, "dynamic" if study.model.states else "static"):
        refit(study, data, base, row)
    return sorted(rows, key=_order)


def rank_only(study: Study, data: Data, base: Fitted, found: Sequence[Candidate]) -> Ranked:
    """The row of one effect at one port, whatever its score; `found` are its shapes."""
    scores = score_all(data, base, found, None)
    residual = np.nan_to_num(base.train.residuals / base.train.scale).ravel()
    p_values = corrected_p_values(scores, residual, len(base.train.residuals))
    return _best_shapes(study, found, scores, p_values, every=True)[0]


def _best_shapes(
    study: Study,
    found: Sequence[Candidate],
    scores: Scores,
    p_values: FloatArray,
    *,
    every: bool = False,
) -> list[Ranked]:
    """One row an effect and port, with the shape that the residual looks like most."""
    best: dict[tuple[str, str], int] = {}
    for index, candidate in enumerate(found):
        if not every and not _possible(candidate, float(scores.strength[index])):
            continue
        key = (candidate.name, candidate.port)
        if key not in best or scores.score[index] > scores.score[best[key]]:
            best[key] = index
    rows = []
    for (name, port), index in best.items():
        cosines = {
            f"{n}@{p}": float(scores.cosines[index, j]) for (n, p), j in best.items() if j != index
        }
        alike = [label for label, cosine in cosines.items() if cosine > ALIKE]
        candidate = found[index]
        rows.append(
            Ranked(
                name, port, study.model.ports[port].kind, float(p_values[index]),
                float(scores.explained[index]), _start(candidate, float(scores.strength[index])),
                alike, cosines, placement=Placement(name, candidate.effect, port),
            )
        )  # fmt: skip
    return sorted(rows, key=lambda row: -row.explained)


def _possible(candidate: Candidate, strength: float) -> bool:
    """Whether the strength that the score suggests lies on the right side of its bounds."""
    p = candidate.effect.parameters[candidate.effect.strength]
    if p.role == "switch":
        return strength > 0
    value = p.neutral + strength
    return min(p.low, p.neutral) <= value <= max(p.high, p.neutral)


def _start(candidate: Candidate, strength: float) -> dict[str, float]:
    p = candidate.effect.parameters[candidate.effect.strength]
    value = 1.0 if p.role == "switch" else float(np.clip(p.neutral + strength, p.low, p.high))
    return {**candidate.shape, candidate.effect.strength: value}


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
    assert row.placement is not None
    lower = f"{row.placement.effect.refines}@{row.port}"
    if lower in row.alike and any(other.label == lower for other in likely):
        return lower
    return next((c for c in row.alike if c in told and _free(told[c]) <= _free(row)), None)


def _free(row: Ranked) -> int:
    assert row.placement is not None
    return row.placement.effect.free


def refit(study: Study, data: Data, base: Fitted, row: Ranked) -> None:
    """Fit the model with the row's effect and judge it on the recordings held out."""
    assert row.placement is not None
    prefix = row.placement.prefix
    start = base.train.values() | {prefix + name: value for name, value in row.start.items()}
    try:
        row.fitted = fit_model(
            study, data, (*base.placements, row.placement), start, base.train.scale
        )
    except ModelError as error:
        row.reason, row.trouble = "cannot be fitted", str(error)
        return
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
    assert row.placement is not None
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

"""Ranks every effect of the library by how well it explains the change since an alarm.

The engine's score test, as in a study: the first-order change that an effect at a port would cause
along the measured motion is compared with the observed change. p-values allow for residuals that
are correlated and for the number of candidates; effects whose directions are nearly parallel form a
class, except those that are clearly worse. Nothing is fitted; a study gives more detail.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from monitor.diagnosis.rig_ports import RigPorts, rig_ports
from monitor.model import RigModel
from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Effect, Port, compose
from rigwatch.physics.engine.fit import filled
from rigwatch.physics.engine.score import (
    Candidate,
    Projector,
    Scores,
    Standing,
    candidates,
    corrected_p_values,
    directions,
    has_variables,
    possible,
    root_mean_square,
    score,
    sizes_at_port,
    standings,
    trajectory,
)
from rigwatch.wire.arrays import FloatArray

LEVEL = 0.01
"""Corrected p-value above which no candidate is named."""
EXPLAINED = 0.5
"""Share of the change's energy below which the best effect is rejected."""
NEARLY = 0.02
"""Difference in that share below which the first order cannot rank two effects."""
BLOCKS, WORSE = 16, 3.0
"""Pieces of the samples over which two effects are compared, and standard errors that count."""
FEWEST = 64
"""Fewest samples for a ranking."""
SETTLED = 0.25
"""Time from the onset until effects have built up [s]."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Samples around an alarm.

    Attributes:
        signals: the model's channels, NaN if invalid, shape (n, channels).
        change: of the residual against the healthy rig [m/s^2], shape (n,).
        onset: row at which the change began.
    """

    signals: FloatArray
    change: FloatArray
    onset: int


@dataclass(frozen=True)
class Suspect:
    """An effect at a port.

    Attributes:
        effect, port: their names.
        p_value: corrected for all candidates.
        explained: share of the change's energy.
        parameters: free ones.
        alike: others that these samples cannot distinguish from it, as "effect@port".
    """

    effect: str
    port: str
    p_value: float
    explained: float
    parameters: int
    alike: tuple[str, ...]

    @property
    def label(self) -> str:
        """Effect and port as one name."""
        return f"{self.effect}@{self.port}"


def suspects(evidence: Evidence, model: RigModel, effects: Mapping[str, Effect]) -> list[Suspect]:
    """Every effect at every port with its best shape, the most likely first.

    An effect whose strength has the wrong sign is excluded.
    """
    ports = rig_ports(model, _bridged(evidence.signals))
    found = _candidates(ports, effects, model)
    pushes = _pushes(ports, found, evidence.onset, 1 / model.sample_rate)
    moved = np.empty_like(pushes)
    for index, candidate in enumerate(found):
        moved[:, index] = ports.responses[candidate.port](pushes[:, index].copy())
    rows = _counted(evidence, model)
    if rows.sum() < FEWEST:
        return []
    scale = model.noise.residual
    residual = (evidence.change - ports.known)[rows] / scale
    nothing = np.zeros((1, len(residual), 0))
    scores = score(
        residual[None], moved[rows][None] / scale, Projector(nothing, nothing), variance=1.0
    )
    p_values = corrected_p_values(scores, residual[None, :, None])
    allowed = _allowed(ports, found, scores, pushes[rows])
    ranked = standings([c.label for c in found], scores, p_values, allowed)
    return _named([(_suspect(found[s.index], s), s.index) for s in ranked], residual, scores.units)


def _counted(evidence: Evidence, model: RigModel) -> NDArray[np.bool_]:
    """Rows whose change the directions can be held against: effects have built up since the onset,
    and filters have settled since the last hole in the signals.
    """
    settled, count = round(SETTLED * model.sample_rate), len(evidence.change)
    missing = ~np.isfinite(evidence.signals).all(axis=1)
    lately = np.convolve(missing, np.ones(max(model.decision.settle, 1)))[:count]
    since_onset = np.arange(count) >= evidence.onset + settled
    whole = lately <= model.decision.longest_hold
    return np.asarray(since_onset & whole & np.isfinite(evidence.change))


def _bridged(signals: FloatArray) -> FloatArray:
    return np.stack([filled(signal) for signal in signals.T], axis=1)


def _candidates(ports: RigPorts, effects: Mapping[str, Effect], model: RigModel) -> list[Candidate]:
    columns = dict(zip(ports.model.inputs, ports.inputs.T, strict=True))
    places = ports.model.ports
    sizes = {name: _sizes(port, columns, 1 / model.sample_rate) for name, port in places.items()}

    def effect_at(name: str, port: str) -> Effect | None:
        effect, place = effects[name], places[port]
        stands = effect.fits(place.kind) and has_variables(effect, place)
        return effect.scaled(sizes[port]) if stands else None

    return candidates(places, effects, effect_at)


def _sizes(port: Port, columns: Mapping[str, FloatArray], dt: float) -> dict[str, float]:
    """Root mean squares of the port's variables; values of effects are relative to these."""
    variables = {name: columns[v.expression] for name, v in port.variables.items()}
    return sizes_at_port(variables, _signal(port, columns) if port.signal else None, dt)


def _signal(port: Port, columns: Mapping[str, FloatArray]) -> FloatArray:
    name = port.signal.removesuffix("_read")
    return columns[name if name in columns else "measured"]


def _pushes(ports: RigPorts, found: Sequence[Candidate], onset: int, dt: float) -> FloatArray:
    """What each candidate adds at its port for a strength of 1, shape (n, candidates)."""
    compiled, count = compile_system(compose(ports.model)), len(ports.inputs)
    at = trajectory(
        compiled, ports.inputs, dt, np.zeros(1, np.int64), count,
        initial=np.zeros((1, 0)), parameters=np.zeros(0), substeps=1,
    )  # fmt: skip
    since = np.maximum(np.arange(count) - onset, 0)[None] * dt
    added = directions(replace(at, time=since), found)[0]
    names = list(ports.model.outputs)
    places = [names.index(ports.outputs[c.port]) for c in found]
    return np.stack([added[:, place, i] for i, place in enumerate(places)], axis=1)


def _allowed(
    ports: RigPorts, found: Sequence[Candidate], scores: Scores, pushes: FloatArray
) -> list[bool]:
    """Whether each candidate's strength has the right sign and a plausible size."""
    allowed = []
    for index, candidate in enumerate(found):
        strength = float(scores.strength[index])
        size = abs(strength) * root_mean_square(pushes[:, index])
        likely = scores.score[index] > 0 and possible(candidate, strength)
        allowed.append(bool(likely and size <= ports.limits.get(candidate.port, np.inf)))
    return allowed


def _suspect(best: Candidate, found: Standing) -> Suspect:
    return Suspect(
        best.name, best.port, found.p_value, found.explained, best.effect.free, tuple(found.alike)
    )


def _named(
    rows: Sequence[tuple[Suspect, int]], residual: FloatArray, units: FloatArray
) -> list[Suspect]:
    """The first gives the class its name: the one with the fewest parameters of those that do as
    well as the best. Members of its class that are clearly worse on the samples are dropped.
    """
    if not rows:
        return []
    top, place = rows[0]
    left = residual[:, None] - units * (units.T @ residual)

    def rivals(row: Suspect, at: int) -> bool:
        near = row.explained > top.explained - NEARLY
        return near or (row.label in top.alike and not _worse(left[:, at], left[:, place]))

    equals = [row for row, at in rows if rivals(row, at)]
    near = [row for row in equals if row.explained > top.explained - NEARLY]
    first = min(near, key=lambda row: row.parameters)
    first = replace(first, alike=tuple(row.label for row in equals if row is not first))
    return [first, *(row for row, _ in rows if row.label != first.label)]


def _worse(left: FloatArray, best: FloatArray) -> bool:
    """Whether one leaves more than the other by more than chance, block by block."""
    more = [piece.mean() for piece in np.array_split(left**2 - best**2, BLOCKS)]
    return bool(np.mean(more) > WORSE * np.std(more, ddof=1) / np.sqrt(len(more)))


def in_words(rows: Sequence[Suspect]) -> str:
    """The ranking in a sentence."""
    if not rows or rows[0].p_value >= LEVEL:
        found = f" ({rows[0].label}, p {_p(rows[0].p_value)})" if rows else ""
        return f"probably missing: cannot tell, no effect is significant{found}"
    best = rows[0]
    figures = f"p {_p(best.p_value)}, {best.explained:.0%} of the change"
    if best.explained < EXPLAINED:
        return f"probably missing: no known effect; the nearest is {best.label} ({figures})"
    text = f"probably missing: {best.label} ({figures})"
    if not best.alike:
        return text
    named, more = best.alike[:6], len(best.alike) - 6
    rest = f" and {more} more" if more > 0 else ""
    return f"{text}; cannot be told from {', '.join(named)}{rest}"


def _p(value: float) -> str:
    return "< 1e-6" if value < 1e-6 else f"= {value:.2g}"

"""Ranks every effect of the library by how well it explains the change since an alarm.

The engine's score test, as in a study: the first-order change that an effect at a port would cause
along the measured motion is compared with the observed change. p-values allow for residuals that
are correlated and for the number of candidates. The first of the ranking are then fitted, so that
an effect counts with the size that it has. Those that explain nearly as much as the best, given how
well the model's response is known, form a class, and the simplest of them names it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from monitor.diagnosis.observed_change import Evidence, ObservedChange, model_error
from monitor.diagnosis.rig_ports import RigPorts, rig_ports
from monitor.diagnosis.sized_effects import sized
from monitor.model import RigModel
from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Effect, Port, compose
from rigwatch.physics.engine.score import (
    Candidate,
    Projector,
    Scores,
    Standing,
    Trajectory,
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

DRY_FRICTION = "dry friction"
SHORTEST = 1 / 60
"""Way to slip, relative to the motion, below which a change of seconds tells no law of dry friction
from Coulomb's."""
LEVEL = 0.01
"""Corrected p-value above which no candidate is named."""
EXPLAINED = 0.5
"""Share of the change's energy below which the best effect is rejected."""
SIZED, LEAST_SIZED = 24, 0.3
"""Number of effects that are fitted, and what each has to explain of what the best explains."""
UNSURE = 0.25
"""Share of what the best effect leaves by which others may leave more and be as likely."""
FEWEST = 64
"""Fewest samples for a ranking."""
MOST_NAMED, MOST_DESCRIBED = 6, 2
"""Number of rivals that are named, and up to which the physics of each is told."""


@dataclass(frozen=True)
class Suspect:
    """An effect at a port.

    Attributes:
        effect, port: their names.
        p_value: corrected for all candidates.
        explained: share of the change's energy.
        parameters: free ones.
        family: of the effect, see `Effect`.
        physics: of the effect in a sentence.
        alike: others that these samples cannot distinguish from it, as "effect@port".
    """

    effect: str
    port: str
    p_value: float
    explained: float
    parameters: int
    family: str = ""
    physics: str = ""
    alike: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Effect and port as one name."""
        return f"{self.effect}@{self.port}"


def suspects(evidence: Evidence, model: RigModel, effects: Mapping[str, Effect]) -> list[Suspect]:
    """Every effect at every port with its best shape, the most likely first.

    An effect whose strength has the wrong sign is excluded.
    """
    change = np.nan_to_num(evidence.change)
    ports = rig_ports(model, evidence.bridged, change)
    observed = ObservedChange(evidence, model, ports)
    if len(observed.values) < FEWEST:
        return []
    found = _candidates(ports, effects, model)
    at = _along(ports, evidence.onset, 1 / model.sample_rate)
    ranked = _ranked(ports, found, observed, _pushes(ports, at, found))
    rows = _sized(ranked, found, at, observed)
    return _named(rows, observed.noise_share, model_error(model))


def _ranked(
    ports: RigPorts, found: Sequence[Candidate], observed: ObservedChange, pushes: FloatArray
) -> list[Standing]:
    """To first order, those that explain most first."""
    moved = [observed.caused(c.port, push) for c, push in zip(found, pushes.T, strict=True)]
    flat = np.stack([one.ravel() for one in moved], axis=1)
    values = observed.values
    nothing = np.zeros((1, values.size, 0))
    scores = score(values.reshape(1, -1), flat[None], Projector(nothing, nothing), variance=1.0)
    p_values = corrected_p_values(scores, values[None])
    allowed = _allowed(ports, found, scores, pushes[observed.rows])
    return standings([c.label for c in found], scores, p_values, allowed)


def _candidates(ports: RigPorts, effects: Mapping[str, Effect], model: RigModel) -> list[Candidate]:
    columns = dict(zip(ports.model.inputs, ports.inputs.T, strict=True))
    places = ports.model.ports
    sizes = {name: _sizes(port, columns, 1 / model.sample_rate) for name, port in places.items()}

    def effect_at(name: str, port: str) -> Effect | None:
        effect, place = effects[name], places[port]
        stands = effect.fits(place.kind) and has_variables(effect, place)
        return _not_too_short(effect).scaled(sizes[port]) if stands else None

    return candidates(places, effects, effect_at)


def _not_too_short(effect: Effect) -> Effect:
    """The effect; of a law of dry friction with no shorter way to slip than a change tells."""
    if effect.family != DRY_FRICTION:
        return effect
    bounded = dict(effect.parameters)
    for name, p in bounded.items():
        if p.scale == "x":
            bounded[name] = structs.replace(p, low=max(p.low, SHORTEST))
        elif p.scale == "1/x":
            bounded[name] = structs.replace(p, high=min(p.high, 1 / SHORTEST))
    return structs.replace(effect, parameters=bounded)


def _sizes(port: Port, columns: Mapping[str, FloatArray], dt: float) -> dict[str, float]:
    """Root mean squares of the port's variables; values of effects are relative to these."""
    variables = {name: columns[v.expression] for name, v in port.variables.items()}
    return sizes_at_port(variables, _signal(port, columns) if port.signal else None, dt)


def _signal(port: Port, columns: Mapping[str, FloatArray]) -> FloatArray:
    name = port.signal.removesuffix("_read")
    return columns[name if name in columns else "measured"]


def _along(ports: RigPorts, onset: int, dt: float) -> Trajectory:
    """The signals at the ports; time runs from the onset."""
    compiled, count = compile_system(compose(ports.model)), len(ports.inputs)
    at = trajectory(
        compiled, ports.inputs, dt, np.zeros(1, np.int64), count,
        initial=np.zeros((1, 0)), parameters=np.zeros(0), substeps=1,
    )  # fmt: skip
    return replace(at, time=np.maximum(np.arange(count) - onset, 0)[None] * dt)


def _pushes(ports: RigPorts, at: Trajectory, found: Sequence[Candidate]) -> FloatArray:
    """What each candidate adds at its port for a strength of 1, shape (n, candidates)."""
    added = directions(at, found)[0]
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


def _sized(
    ranked: Sequence[Standing],
    found: Sequence[Candidate],
    at: Trajectory,
    observed: ObservedChange,
) -> list[Suspect]:
    """All of them, those worth a fit before the others, by what each explains."""
    least = LEAST_SIZED * ranked[0].explained if ranked else 0.0
    fitted, others = list[Suspect](), list[Suspect]()
    for place, one in enumerate(ranked):
        candidate = found[one.index]
        worth = place < SIZED and one.explained > least
        explained = sized(at, candidate, one.strength, observed) if worth else one.explained
        effect = candidate.effect
        row = Suspect(
            candidate.name, candidate.port, one.p_value, explained,
            effect.free, effect.family, effect.physics,
        )  # fmt: skip
        (fitted if worth else others).append(row)
    # What explains the same but for rounding stays in the order of ports: the load comes first.
    return sorted(fitted, key=lambda row: -round(row.explained, 4)) + others


def _named(rows: Sequence[Suspect], noise: float, error: float) -> list[Suspect]:
    """The first names the class: the one with the fewest parameters of those that do as well as the
    best, as far as can be known.

    Of a response's error an effect's size takes the part that is in phase; the rest is left. Where
    even the best leaves more than that, a share of what it leaves counts.

    Args:
        rows: those that explain most first.
        noise: share of the change's energy that is noise.
        error: of the model's response, relative to the signal.
    """
    if not rows:
        return []

    def left(row: Suspect) -> float:
        """Amplitude of what it leaves beside the noise, relative to the change."""
        return math.sqrt(max(1.0 - row.explained - noise, 0.0))

    best = rows[0]
    unsure = max(error / math.sqrt(2.0), UNSURE * left(best))

    def equal(row: Suspect) -> bool:
        # A filter is described as one of samples or of time; neither is what the rig has.
        kin = bool(row.family) and (row.family, row.port) == (best.family, best.port)
        return left(row) <= left(best) + (max(error, unsure) if kin else unsure)

    equals = [row for row in rows if equal(row)]
    first = min(equals, key=lambda row: max(row.parameters, 1))  # a switch is one, too
    first = replace(first, alike=tuple(row.label for row in equals if row is not first))
    return [first, *(row for row in rows if row.label != first.label)]


def in_words(rows: Sequence[Suspect]) -> str:
    """The ranking in sentences for people who know neither the library nor p-values."""
    if not rows or rows[0].p_value >= LEVEL:
        nearest = f" (the nearest is {_fit(rows[0])})" if rows else ""
        return f"probably missing: cannot tell, no effect stands out from chance{nearest}"
    best = rows[0]
    if best.explained < EXPLAINED:
        return f"probably missing: no known effect; the nearest is {_fit(best)}"
    return f"probably missing: {_fit(best)}{_rivals(best, rows)}"


def _rivals(best: Suspect, rows: Sequence[Suspect]) -> str:
    """What explains the same as the best: other laws of one effect, or other effects as well."""
    if not best.alike:
        return ""
    rivals = {row.label: row for row in rows if row.label in best.alike}
    kin = {row.label for row in rows if (row.family, row.port) == (best.family, best.port)}
    named, more = best.alike[:MOST_NAMED], len(best.alike) - MOST_NAMED
    few = len(best.alike) <= MOST_DESCRIBED
    told = [_described(rivals[label]) if few else label for label in named]
    listed = ", ".join(told) + (f" and {more} more" if more > 0 else "")
    one = len(best.alike) == 1
    verb = "explains" if one else "explain"
    if not best.family or not kin.issuperset(best.alike):
        return f"; {listed} {verb} as much in this motion, so check these too"
    other = "another law of it" if one else "other laws of it"
    return (
        f"; {best.family} at {best.port} is settled, by which law is not: {listed}, {other}, "
        f"{verb} as much, and neither alarm nor action depends on the law"
    )


def _described(row: Suspect) -> str:
    """An effect at a port, and its physics in parentheses."""
    physics = row.physics.strip().rstrip(".")
    return f"{row.label} ({physics[0].lower()}{physics[1:]})" if physics else row.label


def _fit(row: Suspect) -> str:
    """An effect, its physics, and how well it explains the change."""
    share = f"explains {row.explained:.0%} of the change since healthy"
    return f"{_described(row)}: {share}, by chance {_chance(row.p_value)}"


def _chance(p_value: float) -> str:
    """How often chance alone would explain as much, as one in so many."""
    if p_value < 1e-6:
        return "less than once in a million"
    if p_value > 0.5:
        return "more often than not"
    return f"about once in {float(f'{1 / p_value:.2g}'):,.0f}"

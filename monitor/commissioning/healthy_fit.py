"""Fits a model of equations to healthy recordings, driven along their measured motion.

The whole recording is one stable run: hidden states begin in balance and need no fit. Residuals are
high-passed as the monitor has them. Positive parameters are searched by their logarithms, and those
that the data do not determine stay near the model file's values.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from monitor.observer import (
    SETTLING,
    SUBSTEPS,
    balanced,
    base_model,
    driven,
    friction_at,
    high_pass,
    rate_columns,
)
from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import Model, compose
from rigwatch.wire.arrays import FloatArray

SPREAD, UNBOUND = 0.15, 2.0
"""How far parameters lie from the file's values: in their logarithm, as a share of what their
bounds allow or, without those, by so much; in their size where they have a sign.
"""
PULL = 0.1
"""Weight of that against the data: a sum over n samples pulls as this share of √n does."""
STARTS, SEED, SHORT, WIDE = 4, 1, 5.0, 0.45
"""Starts of a search, what they are drawn with, how much of each stretch they see [s], and how wide
the logarithm of a parameter must be for it to be searched for first.
"""
LEAST = 1e-6
"""Share of its value to which a parameter with a lower bound of 0 may fall."""
LIMIT = 1e3
"""Residuals of a run that diverges, in deviations."""
BEGIN = 0.5
"""What a recording's own high-pass takes to settle is not counted [s]."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """One stretch of a healthy recording: inputs and motion, shape (n, inputs), and the output."""

    rows: FloatArray
    measured: FloatArray


@dataclass(frozen=True, eq=False)
class HealthyFit:
    """A fitted model.

    Attributes:
        names, values: parameters of the model.
        coulomb: dry friction of the healthy rig [N].
        rms: of the high-passed residual over all stretches.
    """

    names: tuple[str, ...]
    values: tuple[float, ...]
    coulomb: float
    rms: float


@dataclass(eq=False)
class _Stage:
    """One least-squares problem: some parameters free, the others as they stand."""

    model: Model
    port: str
    turn: float
    corner: float
    rate: float
    free: frozenset[str]
    stretches: Sequence[Stretch]
    begin: Mapping[str, float]
    noise: float
    compiled: CompiledSystem = field(init=False)
    still: CompiledSystem = field(init=False)

    def __post_init__(self) -> None:
        frictions = friction_at(self.port, self.turn)[:1]
        self.dry = f"{frictions[0].prefix}{frictions[0].effect.strength}"
        system = compose(driven(self.model, self.free), frictions)
        self.compiled = compile_system(system)
        self.still = compile_system(compose(driven(self.model, frozenset())))
        self.names = list(system.parameters)
        self.moved = [self.names.index(name) for name in system.free]
        self.base = self.compiled.vector(dict(self.begin))
        self.lows = np.array([system.parameters[name].low for name in system.free])
        self.highs = np.array([system.parameters[name].high for name in system.free])
        own = self.compiled.parameters[self.moved]
        self.log = (own > 0.0) & (self.lows >= 0.0)
        self.lows = np.where(self.log, np.maximum(self.lows, LEAST * np.abs(own)), self.lows)
        spans = np.where(np.isfinite(self.highs - self.lows), self.highs - self.lows, 0.0)
        self.size = np.where(own != 0.0, np.abs(own), np.where(spans > 0, 0.05 * spans, 0.05))
        self.spread = self._spreads()
        self.aim = self.searched(self.compiled.parameters)
        self.filter = high_pass(self.corner, self.rate)

    def _spreads(self) -> FloatArray:
        with np.errstate(divide="ignore", invalid="ignore"):
            spans = SPREAD * np.log(self.highs / self.lows)
        bound = self.log & np.isfinite(spans) & (spans < UNBOUND)
        return np.where(bound, spans, UNBOUND)

    def searched(self, parameters: FloatArray) -> FloatArray:
        """Parameters as the search moves them, within their bounds."""
        own = np.clip(parameters[self.moved], self.lows, self.highs)
        return np.where(self.log, np.log(np.where(self.log, own, 1.0)), own / self.size)

    def parameters(self, q: FloatArray) -> FloatArray:
        """All parameters at a place of the search."""
        found = self.base.copy()
        found[self.moved] = np.where(self.log, np.exp(np.where(self.log, q, 0.0)), q * self.size)
        return found

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Of the search."""
        with np.errstate(divide="ignore", invalid="ignore"):
            low = np.where(self.log, np.log(np.abs(self.lows)), self.lows / self.size)
            high = np.where(self.log, np.log(np.abs(self.highs)), self.highs / self.size)
        return low, high

    def residuals(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Scaled residuals, those of the prior last, and their Jacobian."""
        p = self.parameters(q)
        scale = np.where(self.log, p[self.moved], self.size) / self.noise
        parts = [self._stretch(p, one) for one in self.stretches]
        errors = np.concatenate([error / self.noise for error, _ in parts])
        slopes = np.concatenate([slope * scale for _, slope in parts])
        pull = PULL * np.sqrt(errors.size) / self.spread
        return (
            np.concatenate([np.clip(errors, -LIMIT, LIMIT), (q - self.aim) * pull]),
            np.concatenate([slopes, np.diag(pull)]),
        )

    def _stretch(self, p: FloatArray, one: Stretch) -> tuple[FloatArray, FloatArray]:
        skip = round(BEGIN * self.rate)
        with np.errstate(over="ignore", invalid="ignore"):
            made = self.compiled.simulate(
                one.rows, 1.0 / self.rate, np.zeros(1, np.int64), len(one.rows),
                initial=self._start(p, one.rows)[None, :], parameters=p, substeps=SUBSTEPS,
            )  # fmt: skip
        error = made.outputs[0, :, 0] - one.measured
        slope = made.slopes[0, :, 0, : len(self.moved)]
        if not (np.isfinite(error).all() and np.isfinite(slope).all()):
            return np.full(error.size - skip, LIMIT * self.noise), np.zeros_like(slope[skip:])
        return (
            lfilter(*self.filter, error)[skip:],
            lfilter(*self.filter, slope, axis=0)[skip:],
        )

    def _start(self, p: FloatArray, rows: FloatArray) -> FloatArray:
        still = np.repeat(rows[:1], round(0.5 * SETTLING * self.rate), axis=0)
        still[:, rate_columns(self.model)] = 0.0
        return balanced(self.still, p[: len(self.still.parameters)], still, 1.0 / self.rate)

    def solved(self, evaluations: int) -> tuple[dict[str, float], float]:
        """Parameters by name, and the rms that is left of the data."""
        kept: dict[bytes, tuple[FloatArray, FloatArray]] = {}

        def at(q: FloatArray) -> tuple[FloatArray, FloatArray]:
            if (key := q.tobytes()) not in kept:
                kept.clear()
                kept[key] = self.residuals(q)
            return kept[key]

        low, high = self.bounds()
        inside = np.clip(self.searched(self.base), low + 1e-6, high - 1e-6)
        found = least_squares(
            lambda q: at(q)[0], inside, jac=lambda q: at(q)[1], bounds=(low, high),
            x_scale="jac", ftol=1e-5, xtol=1e-6, max_nfev=evaluations,
        )  # fmt: skip
        p = self.parameters(found.x)
        data = at(found.x)[0][: -len(self.moved)]
        values = dict(zip(self.names, p.tolist(), strict=True))
        return values, float(np.sqrt(np.mean(data**2)) * self.noise)


def fit_healthy(
    name: str,
    port: str,
    stretches: Sequence[Stretch],
    *,
    turn: float,
    corner: float,
    rate: float,
    noise: float,
    known: Mapping[str, float] | None = None,
) -> HealthyFit:
    """Parameters of the model called `name` from healthy stretches.

    Args:
        name: of a shipped model, or its file.
        port: where friction enters.
        stretches: what was measured, smoothed.
        turn: speed over which dry friction turns its sign.
        corner: of the high-pass [Hz].
        rate: samples a second [Hz].
        noise: of the measured output, rms.
        known: parameters that have been found already, and stay.
    """
    model = base_model(name)
    known = known or {}

    def stage(free: frozenset[str], data: Sequence[Stretch], values: Mapping[str, float]) -> _Stage:
        return _Stage(model, port, turn, corner, rate, free, data, values, noise)

    every = _every(model) - set(known)
    strong = _strong(model) & every
    short = [_shortened(one, rate) for one in stretches]
    own = {n: p.value for n, p in model.parameters.items()} | dict(known)
    tried = []
    for start in _starts(model, strong, own):
        found, _ = stage(strong, short, start).solved(25)
        tried.append(stage(every, short, found).solved(40))
    last = stage(every, stretches, min(tried, key=lambda one: one[1])[0])
    values, rms = last.solved(60)
    names = tuple(model.parameters)
    return HealthyFit(names, tuple(values[n] for n in names), max(values[last.dry], 0.0), rms)


def _every(model: Model) -> frozenset[str]:
    """What a healthy rig determines: parameters that are free, and those that it keeps."""
    return frozenset(n for n, p in model.parameters.items() if p.kept or not p.fixed)


def _strong(model: Model) -> frozenset[str]:
    """Of those, the ones that may be far from the file's values."""
    found = []
    for name in _every(model):
        p = model.parameters[name]
        wide = p.low > 0.0 and SPREAD * np.log(p.high / p.low) >= WIDE
        if wide or not p.fixed:
            found.append(name)
    return frozenset(found)


def _starts(
    model: Model, strong: frozenset[str], own: Mapping[str, float]
) -> Iterator[dict[str, float]]:
    """The file's values, then strong positive parameters drawn from as wide as they may lie."""
    rng = np.random.default_rng(SEED)
    yield dict(own)
    for _ in range(STARTS - 1):
        drawn = dict(own)
        for name in sorted(strong):
            p = model.parameters[name]
            if p.low > 0.0 and np.isfinite(p.high):
                width = min(SPREAD * np.log(p.high / p.low), UNBOUND)
                value = p.value * np.exp(rng.uniform(-width, width))
                drawn[name] = float(np.clip(value, p.low, p.high))
        yield drawn


def _shortened(one: Stretch, rate: float) -> Stretch:
    """The beginning of a stretch, for searches from many starts."""
    n = round(SHORT * rate)
    return Stretch(one.rows[:n], one.measured[:n])

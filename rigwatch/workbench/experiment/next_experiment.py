"""Next experiment: the excitation that separates rivals most, predicted by simulation.

Each excitation within the range driven so far is simulated with the fitted model; a machine without
inputs is released from where it has been. The rivals'
directions along that trajectory are projected off the subspace of the model's own parameters. The
remainder

    separation = strength · ‖d_best − (d_best·d_rival) d_rival/‖d_rival‖²‖ / √samples

is the rms difference between the best effect and a rival that the new recording would show. Each
output is divided by its noise floor, so separations are in noise floors.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.equations import Input, State
from rigwatch.physics.engine.fit import initial_states, shown_states
from rigwatch.physics.engine.score import Candidate, Projector, directions, trajectory
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import unit_of
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.experiment.excitation_shapes import shapes
from rigwatch.workbench.fit import nodes
from rigwatch.workbench.ranking import Ranked
from rigwatch.workbench.study import Derived

DURATION = 20.0
"""Length of the simulated recordings [s], of a machine that is recorded so fast."""
LEAST_SAMPLES, MOST_SAMPLES = 2000, 8000
"""Samples of a simulated recording: of a slow machine as many as have been recorded, up to the
first; of a fast one no more than the second."""
RELEASES = (1.0, 0.7, 0.5, 0.3, 0.1)
"""Deviations that a machine without inputs is released from, over the largest so far."""


@dataclass(frozen=True)
class Experiment:
    """A recording that would separate the best effect from its rivals.

    Attributes:
        shape: of the excitation, in words.
        signal: the driven input; without inputs the state that the machine is released from.
        amplitude: of the driven input, or the state's deviation from its mean, in `unit`.
        unit: that of the input or state.
        duration: [s].
        separation: predicted rms difference per rival, in noise floors.
        now: the same on the current recording.
        text: summary in one sentence.
    """

    shape: str
    signal: str
    amplitude: float
    unit: str
    duration: float
    separation: dict[str, float]
    now: dict[str, float]
    text: str


def propose(bench: Bench, best: Ranked, rivals: Sequence[Ranked]) -> Experiment | None:
    """The best excitation tried; None if none separates better than the current recording."""
    rows = [best, *rivals]
    train = bench.data.train
    now = _separation(bench, rows, train.inputs[:MOST_SAMPLES], _first_states(bench))
    found = [
        (name, share, _separation(bench, rows, inputs, first))
        for name, share, inputs, first in _excitations(bench)
    ]
    usable = [item for item in found if all(np.isfinite(v) for v in item[2].values())]
    if not usable:
        return None
    name, share, separation = max(usable, key=lambda item: min(item[2].values()))
    if min(separation.values()) <= min(now.values()):
        return None
    return _worded(bench, name, share, separation, now)


def excitation(bench: Bench, experiment: Experiment) -> FloatArray:
    """The inputs of a proposed experiment at the recording's rate, shape (samples, inputs)."""
    share = experiment.amplitude / _amplitude(bench, experiment.signal)
    for name, size, inputs, _ in _excitations(bench):
        if name == experiment.shape and np.isclose(size, share):
            return inputs
    raise ModelError(f"found experiment {experiment.shape!r}, expected one that was proposed here")


def _worded(
    bench: Bench, name: str, share: float, separation: dict[str, float], now: dict[str, float]
) -> Experiment:
    signal, model = _varied(bench), bench.study.model
    driven = model.inputs[signal] if model.inputs else bench.base.compiled.system.states[signal]
    amplitude = share * _amplitude(bench, signal)
    rival, size = min(separation.items(), key=lambda item: item[1])
    size_of = ", amplitude" if model.inputs else " from"
    duration = _samples(bench) * bench.data.train.dt
    text = (
        f"{name} of {signal}{size_of} {_in_words(amplitude, driven)}, {duration:.3g} s:"
        f" {rival} would differ by {size:.3g} noise floors (on this recording: {now[rival]:.3g})"
    )
    return Experiment(name, signal, amplitude, driven.unit, duration, separation, now, text)


def _in_words(amplitude: float, driven: Input | State) -> str:
    """An amplitude in the unit of the model's file; a unit's offset does not apply."""
    shown = driven.shown or driven.unit
    return f"{amplitude / float(unit_of(shown).factor):.3g} {shown}"


def _varied(bench: Bench) -> str:
    """What is varied: an input, in an inverse model the one whose derivatives are the others.

    Without inputs the first state that a channel shows, else the first.
    """
    if not bench.study.model.inputs:
        system = bench.base.compiled.system
        names = [n for n, state in system.states.items() if state.measured]
        return next(iter([*names, *system.states]))
    derive = bench.study.file.derive
    if derive is not None:
        for signal in derive.signals.values():
            if signal.channel in bench.study.model.inputs:
                return signal.channel
    return next(iter(bench.study.model.inputs))


def _amplitude(bench: Bench, signal: str) -> float:
    if not bench.study.model.inputs:
        at = list(bench.base.compiled.system.states).index(signal)
        return float(np.ptp(_states(bench)[:, at]) / 2)
    column = bench.data.train.inputs[:, list(bench.study.model.inputs).index(signal)]
    return float(np.ptp(column) / 2)


def _excitations(bench: Bench) -> Iterator[tuple[str, float, FloatArray, FloatArray]]:
    """Shape in words, share of the amplitude so far, inputs, and states at the first sample."""
    dt, count = bench.data.train.dt, _samples(bench)
    time: FloatArray = np.arange(count, dtype=np.float64) * dt
    rest = _rest(bench)
    if not bench.study.model.inputs:
        signal = _varied(bench)
        at = np.arange(len(rest)) == list(bench.base.compiled.system.states).index(signal)
        for share in RELEASES:
            first = rest + at * share * _amplitude(bench, signal)
            yield "release", share, np.zeros((count, 0)), first
        return
    for share in (1.0, 0.3):
        for name, shape in shapes(time[-1], dt).items():
            inputs = _inputs(bench, shape(time), share)
            if inputs is not None:
                yield name, share, inputs, rest


def _samples(bench: Bench) -> int:
    """Samples of a simulated recording, in whole horizons if it holds one."""
    train, horizon = bench.data.train, bench.data.horizon
    longest = max(part.stop - part.start for part in train.slices)
    count = int(min(max(DURATION / train.dt, min(longest, LEAST_SAMPLES)), MOST_SAMPLES))
    return count // horizon * horizon or count


def _inputs(bench: Bench, shape: FloatArray, share: float) -> FloatArray | None:
    """All inputs for a shape of the driven input; None if a derivative exceeds its past range."""
    recording, names = bench.data.train, list(bench.study.model.inputs)
    driven = _varied(bench)
    middle = recording.inputs.mean(axis=0)
    inputs = np.tile(middle, (len(shape), 1))
    at = names.index(driven)
    low, high = recording.inputs[:, at].min(), recording.inputs[:, at].max()
    inputs[:, at] = (low + high) / 2 + share * (high - low) / 2 * shape
    derive = bench.study.file.derive
    signals: Mapping[str, Derived] = derive.signals if derive else {}
    for name, signal in signals.items():
        if name in names and signal.channel == driven and signal.order:
            rate = inputs[:, at]
            for _ in range(signal.order):
                rate = np.gradient(rate, recording.dt)
            if np.abs(rate).max() > 1.2 * np.abs(recording.inputs[:, names.index(name)]).max():
                return None
            inputs[:, names.index(name)] = rate
    return inputs


def _rest(bench: Bench) -> FloatArray:
    """States at rest in the middle of where the machine has been: rates are zero."""
    rates = [bool(state.rate_of) for state in bench.base.compiled.system.states.values()]
    return np.where(rates, 0.0, _states(bench).mean(axis=0))


def _first_states(bench: Bench) -> FloatArray:
    return np.asarray(_states(bench)[0])


def _states(bench: Bench) -> FloatArray:
    """States from the channels, hidden ones as fitted at each window's beginning, shape (n, k)."""
    system, fitted = bench.base.compiled.system, bench.base.train.initial
    found = initial_states(system, bench.data.train)
    hidden = sorted(set(range(found.shape[1])) - shown_states(system))
    if hidden and len(fitted):
        window = np.minimum(np.arange(len(found)) // bench.base.horizon, len(fitted) - 1)
        found[:, hidden] = fitted[window][:, hidden]
    return found


def _separation(
    bench: Bench, rows: Sequence[Ranked], inputs: FloatArray, first: FloatArray
) -> dict[str, float]:
    base, dt = bench.base, bench.data.train.dt
    starts, substeps = np.zeros(1, np.int64), nodes(base, bench.data.train)
    run = base.compiled.simulate(
        inputs, dt, starts, len(inputs), initial=first[None], parameters=base.train.parameters,
        substeps=substeps,
    )  # fmt: skip
    at = trajectory(
        base.compiled, inputs, dt, starts, len(inputs), initial=first[None],
        parameters=base.train.parameters, substeps=substeps,
    )  # fmt: skip
    moved = directions(at, [_candidate(row) for row in rows]) / bench.floor.rms[:, None]
    slopes = run.slopes / bench.floor.rms[:, None]
    if not (np.isfinite(moved).all() and np.isfinite(slopes).all()):
        return {row.label: np.nan for row in rows[1:]}
    flat = (1, -1)
    slopes = slopes.reshape(*flat, slopes.shape[-1])
    m = len(base.compiled.system.free)
    left = Projector(slopes[..., :m], slopes[..., m:]).clean(moved.reshape(*flat, len(rows)))
    return {
        row.label: _relative_difference(left, i, rows[0]) for i, row in enumerate(rows[1:], start=1)
    }


def _relative_difference(left: FloatArray, rival: int, best: Ranked) -> float:
    one, other = left[:, 0], left[:, rival]
    energy = max(float(other @ other), 1e-300)
    apart = one - other * float(one @ other) / energy
    return abs(_strength(best)) * float(np.sqrt(np.mean(apart**2)))


def _strength(row: Ranked) -> float:
    effect = row.placement.effect
    if row.fitted is not None:
        value = row.fitted.train.values()[row.placement.prefix + effect.strength]
    else:
        value = row.start[effect.strength]
    return value - effect.parameters[effect.strength].neutral


def _candidate(row: Ranked) -> Candidate:
    """The effect with its shape as fitted, to which its strength belongs."""
    effect = row.placement.effect
    values = row.placement.own(row.fitted.train.values()) if row.fitted else row.start
    shape = {name: value for name, value in values.items() if name != effect.strength}
    return Candidate(row.effect, effect, row.port, shape)

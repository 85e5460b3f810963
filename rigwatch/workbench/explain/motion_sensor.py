"""Faults of the sensor whose measured motion drives the model; no port can represent them.

Along the measured motion a sensor fault enters all equations that contain position or speed. The
fault is therefore subtracted from the reading, to first order in its strength s, and likewise from
the rate:

    x = x_read - s·d(x_read),   v = v_read - s·(∂d/∂x·v_read + ∂d/∂t)

s is found by Gauss-Newton steps. The derivative of the error with respect to s is a finite
difference of two simulations; the parameters are refitted after each step. The held-out error
decides, as for any other effect.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.fit import Recording, evaluate, with_effects
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench, refuse_what_spoils
from rigwatch.workbench.data import Data, MotionSensor
from rigwatch.workbench.explain.indistinguishable import EQUAL, NEARLY, lead
from rigwatch.workbench.explain.verdict import Verdict, Word
from rigwatch.workbench.explain.verdict_calibration import Evidence
from rigwatch.workbench.fit import Fitted, fit_model
from rigwatch.workbench.ranking import Ranked, denied_sensors, denies_gain, judge_fit

STEPS = 2
"""Gauss-Newton steps; the error is nearly linear in the strength."""
CHANGE, LARGEST = 0.05, 0.5
"""Change of position over its standard deviation: of the finite difference, and of a step at
most."""
WORTH = 0.1
"""Smallest share of the error's energy above the floor, to first order, that justifies a fit."""

LATE, GAIN = "lag", "gain"
"""The effect that can only be positive, since a sensor is causal, and that of a wrong scale."""

Motion = tuple[FloatArray, FloatArray]
Direction = Callable[[FloatArray, FloatArray, FloatArray], Motion]
"""Changes of position and speed from position, speed and time, each of shape (n,)."""

DIRECTIONS: Mapping[str, Direction] = {
    GAIN: lambda x, v, _: (x, v),
    "offset": lambda x, v, _: (np.ones_like(x), np.zeros_like(v)),
    "drift": lambda _, v, t: (t, np.ones_like(v)),
    "curvature": lambda x, v, _: (x * x, 2 * x * v),
    LATE: lambda _, v, t: (-v, -np.gradient(v, t)),
}
"""Change of position and speed by each sensor effect of strength 1."""


def motion_sensor_rows(bench: Bench) -> list[Ranked]:
    """Candidate effects at the motion sensors, fitted and judged."""
    found = []
    least = WORTH * bench.floor.above(bench.base.train)
    denied = denied_sensors(bench.study, bench.data)
    for sensor in bench.data.motion:
        if sensor.port in denied:
            continue
        for name, direction in DIRECTIONS.items():
            effect = bench.study.effects.get(name)
            if effect is None:
                continue
            try:
                strength, explained = _step(bench.base, bench.data, sensor, direction)
                if explained < least or (name == LATE and strength < 0):
                    continue
                fitted, strength = _fitted(bench, sensor, direction, strength)
            except (ModelError, np.linalg.LinAlgError):
                continue
            row = _row(Placement(name, effect, sensor.port), explained, strength)
            row.fitted = fitted
            judge_fit(bench.base, row)
            refuse_what_spoils(bench, [row])
            _deny_gain(bench, sensor, row)
            found.append(row)
    return found


def _deny_gain(bench: Bench, sensor: MotionSensor, row: Ranked) -> None:
    """Refuse a gain that the sensor of the motion's balance would have shown."""
    healthy = bench.data.healthy
    if not row.accepted or row.placement.name != GAIN or healthy is None:
        return
    gain = row.start[row.placement.effect.strength]
    test = with_effects(bench.study.model, bench.data.train)
    reason = denies_gain(healthy, test, sensor.rate, gain)
    if reason:
        row.accepted, row.reason = False, reason


def _row(placement: Placement, explained: float, strength: float) -> Ranked:
    """A row whose `start` is the strength found; a gain is reading over true position."""
    value = 1 / (1 - strength) if placement.name == "gain" else strength
    start = {placement.effect.strength: value}
    return Ranked(placement, "sensor", 0.0, explained, start, [], {}, {})


def _fitted(
    bench: Bench, sensor: MotionSensor, direction: Direction, strength: float
) -> tuple[Fitted, float]:
    """The base model refitted on the corrected motion, and the strength of the fault."""
    base = bench.base
    for step in range(STEPS):
        data = _corrected_data(bench.data, sensor, direction, strength)
        found = fit_model(
            bench.study, data, base.placements, base.train.values(), base.train.scale, base=base
        )
        if step + 1 < STEPS:
            strength += _step(found, data, sensor, direction)[0]
    return found, strength


def _step(
    at: Fitted, data: Data, sensor: MotionSensor, direction: Direction
) -> tuple[float, float]:
    """A Gauss-Newton step of the strength, jointly with the free parameters; share explained."""
    change = CHANGE * _unit(data.train, sensor, direction)
    moved = corrected(data.train, sensor, direction, change)
    there = evaluate(at.train, moved, at.horizon, at.substeps, at.train.initial)
    error = at.train.error.ravel()
    column = (there.error.ravel() - error) / change
    free = at.train.jacobian.reshape(error.size, -1)
    basis = np.linalg.qr(free / np.maximum(np.linalg.norm(free, axis=0), 1e-300))[0]
    column, left = column - basis @ (basis.T @ column), error - basis @ (basis.T @ error)
    energy = float(column @ column)
    step = -float(column @ left) / max(energy, 1e-300)
    largest = LARGEST / CHANGE * change
    return float(np.clip(step, -largest, largest)), step**2 * energy / float(error @ error)


def _unit(recording: Recording, sensor: MotionSensor, direction: Direction) -> float:
    """Strength that changes the position by its standard deviation (rms)."""
    x, v = (recording.inputs[:, c] for c in (sensor.position, sensor.rate))
    change = direction(x, v, _times(recording, len(x)))[0]
    return float(np.std(x) / max(float(np.sqrt(np.mean(change**2))), 1e-300))


def _times(recording: Recording, samples: int) -> FloatArray:
    return np.asarray(np.arange(samples) * recording.dt, np.float64)


def _corrected_data(
    data: Data, sensor: MotionSensor, direction: Direction, strength: float
) -> Data:
    train, held_out = (
        corrected(r, sensor, direction, strength) for r in (data.train, data.held_out)
    )
    openings = data.openings and corrected(data.openings, sensor, direction, strength)
    return replace(data, train=train, held_out=held_out, openings=openings)


def corrected(
    recording: Recording, sensor: MotionSensor, direction: Direction, strength: float
) -> Recording:
    """The recording with the sensor's fault removed from the motion."""
    inputs, begin = recording.inputs.copy(), 0
    for length in recording.parts or (len(recording),):
        part = inputs[begin : begin + length]
        x, v = part[:, sensor.position].copy(), part[:, sensor.rate].copy()
        dx, dv = direction(x, v, _times(recording, length))
        size = strength if sensor.present is None else strength * part[:, sensor.present]
        part[:, sensor.position] -= size * dx
        part[:, sensor.rate] -= size * dv
        begin += length
    return replace(recording, inputs=inputs)


def with_motion_sensor(bench: Bench, found: Verdict) -> Verdict:
    """The verdict after comparing motion-sensor faults with the effect named.

    Args:
        bench: the study; unchanged unless the model runs along the measured motion.
        found: the verdict on effects at the ports of the model along the motion.
    """
    if found.best is None and bench.floor.reached(bench.base.held_out):
        return found
    rows = [row for row in motion_sensor_rows(bench) if row.accepted]
    if not rows:
        return found
    best = min(rows, key=lambda row: row.held_out_error)
    assert best.fitted is not None
    named = found.best if found.word != "unknown_effect" else None
    if bench.floor.reached(best.fitted.held_out) and (named is None or _is_better(best, named)):
        return _named(bench, best, rows)
    if found.best is None or found.best.gain is None or best.gain is None:
        return found
    if best.gain < NEARLY * found.best.gain:
        return found
    text = f"{found.best.label} may be missing, but {best.label} explains nearly as much or more"
    return replace(found, word="undetermined", rivals=(*found.rivals, best.label), text=text)


def _named(bench: Bench, best: Ranked, rows: list[Ranked]) -> Verdict:
    """The verdict that names a sensor fault."""
    alike = [row.label for row in rows if row is not best and not _is_better(best, row)]
    name, value = next(iter(best.start.items()))
    assert best.fitted is not None
    text = (
        f"{best.label} is missing ({name} = {value:.4g} in SI units): the held-out error falls from"
        f" {bench.base.told_error:.3g} to {best.fitted.told_error:.3g} {bench.base.told_in}"
    )
    left = bench.floor.left_over(bench.base.held_out, best.fitted.held_out)
    word: Word = "undetermined" if alike else "missing_effect"
    return Verdict(word, best, (best.label,), tuple(alike), text, evidence=Evidence(left))


def _is_better(one: Ranked, other: Ranked) -> bool:
    """Whether one has the lower held-out error by more than chance."""
    return lead(one, other) > EQUAL

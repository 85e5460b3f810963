"""The direct approach (Distefano and Rath; thesis 2.1): the equations of motion as a regression.

    m·ẍ + a1·x + a2·x³ + a3·ẋ + a4·ẋ³ = p(t),   J(a) = ∫ ( … − p )² dt,   A·a = b     (2.4)-(2.10)

If accelerations are measured, velocities and positions are their integrals. What is not measured is
derived: a velocity from the acceleration by the trapezoidal rule, else as the slope of a spline
through the position, and an acceleration likewise. Nothing is simulated, so the method is fast, and
every error of the accelerations goes straight into the result.
"""

import numpy as np
import sympy
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import make_interp_spline

from rigwatch.physics.engine.equations import symbol
from rigwatch.structures.identification.identify import Outcome, settled, unsettled
from rigwatch.structures.identification.least_squares import require_determined
from rigwatch.structures.identification.least_squares import solve as least_squares
from rigwatch.structures.identification.problem import Problem
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

DEGREE = 5
"""Degree of the splines that are differentiated."""


def solve(problem: Problem, *, iterations: int = 25) -> Outcome:
    """Solve one linear problem; several if an unknown enters nonlinearly, such as a mass.

    Raises:
        ModelError: an initial state is unknown, no signal shows a state, or the record does not
            determine the unknowns.
    """
    system = problem.system
    if len(problem.loose):
        raise ModelError(
            f"{system.model.name}: direct cannot identify initial states, expected known ones"
        )
    states, rates = motion(problem)
    scale = np.sqrt(np.mean(rates**2, axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    found, count, covariance = [problem.guess], len(problem.free), None
    for turn in range(iterations):
        parameters, _ = problem.split(found[-1])
        modelled, slopes = problem.sweeper.rates(
            problem.inputs, problem.recording.dt, problem.first, states, parameters
        )
        step = least_squares(rates - modelled, slopes[..., :count], problem.weight, scale)
        if not turn:
            require_determined(problem.names, step.blind, system.model.name)
        found.append(found[-1] + step.change)
        covariance = step.covariance
        if settled(found[-2], found[-1]):
            require_determined(problem.names, step.blind, system.model.name)
            return Outcome(found[1:], covariance, True)
    return Outcome(found[1:], covariance, False, (unsettled(iterations),))


def motion(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """States and their rates from the record, each of shape (samples, n)."""
    system = problem.system
    signals = _measured(problem)
    states = list(system.states)
    for _ in states:
        for index, name in enumerate(states):
            below, rate = symbol(name), system.derivatives[name]
            if below not in signals and rate in signals:
                whole = cumulative_trapezoid(signals[rate], dx=problem.recording.dt, initial=0.0)
                signals[below] = problem.initial[index] + whole
    for _ in states:
        for name in states:
            below, rate = symbol(name), system.derivatives[name]
            if below in signals and rate not in signals:
                signals[rate] = _slope(signals[below], problem.recording.dt)
    for name in states:
        if symbol(name) not in signals:
            raise ModelError(
                f"{system.model.name}: found no signal without missing samples that shows {name},"
                f" which the direct approach needs{_with_gaps(problem)}"
            )
    columns = [signals[symbol(name)] for name in states]
    return (
        np.stack(columns, axis=1),
        np.stack([signals[system.derivatives[name]] for name in states], axis=1),
    )


def _measured(problem: Problem) -> dict[sympy.Expr, FloatArray]:
    """The signals of the record, by meaning: a state, or the rate of one."""
    system = problem.system
    rates = set(system.derivatives.values())
    known = {symbol(name) for name in system.states} | rates
    return {
        expression: problem.observed[:, index]
        for index, expression in enumerate(system.outputs.values())
        if expression in known and np.isfinite(problem.observed[:, index]).all()
    }


def _with_gaps(problem: Problem) -> str:
    """The signals that were left out since samples are missing, at the end of a sentence."""
    there = np.isfinite(problem.observed)
    some = np.asarray(there.any(axis=0) & ~there.all(axis=0))
    found = [name for name, gaps in zip(problem.system.outputs, some, strict=True) if gaps]
    return f"; samples are missing of {', '.join(found)}" if found else ""


def _slope(signal: FloatArray, dt: float) -> FloatArray:
    time = np.arange(len(signal)) * dt
    degree = min(DEGREE, len(signal) - 1 - (len(signal) % 2))
    return np.asarray(make_interp_spline(time, signal, k=max(degree, 1)).derivative()(time))

"""Fits with hidden states continued: two tanks in cascade, the upper level of which is not shown.

The recordings are made by Euler steps of their own.
"""

import numpy as np
import pytest

from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import compose, parse_model
from rigwatch.physics.engine.fit import Recording, fit, joined
from rigwatch.physics.engine.search.continued_fit import continued_error_at, fit_continued
from rigwatch.wire.arrays import FloatArray

TANKS = """
name = "tanks"
summary = "Two tanks in cascade."
hold = "zero"
inputs.pump = { unit = "V" }
parameters.k = { value = 0.08, unit = "1/s", low = 0.0 }
parameters.a = { value = 0.08, unit = "V^(1/2)/s", low = 0.0 }
parameters.b = { value = 0.08, unit = "V^(1/2)/s", low = 0.0 }
parameters.d = { value = 0.01, unit = "V", fixed = true }
outputs.lower = { unit = "V", expression = "y" }
[states.x]
unit = "V"
derivative = "k*pump - a*x*sqrt(1/(abs(x) + d))"
start = 3.0
[states.y]
unit = "V"
derivative = "a*x*sqrt(1/(abs(x) + d)) - b*y*sqrt(1/(abs(y) + d))"
measured = "lower"
"""
SHOWN = TANKS.replace("start = 3.0", 'measured = "upper"') + (
    '[outputs.upper]\nunit = "V"\nexpression = "x"\n'
)
TRUE = {"k": 0.05, "a": 0.055, "b": 0.06}
EVERY, STEPS, SAMPLES = 4.0, 40, 320
"""Time between samples [s], Euler steps in each, and samples of a recording."""
NOISE = 0.015
"""Standard deviation of the sensors [V]."""
HORIZON = 16
"""Samples of a window, which is shorter than the upper tank's time constant."""


def filled_tanks(seed: int) -> Recording:
    """Levels of the lower and the upper tank [V]."""
    draw = np.random.default_rng(seed)
    time = EVERY * np.arange(SAMPLES)
    tones = draw.uniform(1 / 900, 1 / 120, 8)[:, None]
    tones = 2 * np.pi * tones * time + draw.uniform(0, 2 * np.pi, (8, 1))
    pump = np.clip(3.0 + draw.uniform(0.3, 1.0, 8) @ np.sin(tones), 0.5, 7.0)
    upper, lower, levels = 6.0, 5.0, np.empty((SAMPLES, 2))
    for row, volts in enumerate(pump):
        levels[row] = lower, upper
        for _ in range(STEPS):
            flow = TRUE["a"] * np.sqrt(max(upper, 0.0))
            upper += EVERY / STEPS * (TRUE["k"] * volts - flow)
            lower += EVERY / STEPS * (flow - TRUE["b"] * np.sqrt(max(lower, 0.0)))
    return Recording(EVERY, pump[:, None], levels + NOISE * draw.normal(size=levels.shape))


def recording(seed: int, channels: int) -> Recording:
    """Two recordings, with the first of the channels only."""
    both = joined([filled_tanks(seed), filled_tanks(seed + 1)])
    return Recording(both.dt, both.inputs, both.outputs[:, :channels], parts=both.parts)


def compiled(text: str) -> CompiledSystem:
    return compile_system(compose(parse_model(text, "tanks.toml")))


@pytest.mark.parametrize("seed", [0, 2, 4])
def test_short_windows_determine_parameters_better_if_hidden_levels_continue(seed: int) -> None:
    made, tanks = recording(seed, 1), compiled(TANKS)
    anew, found = (each(tanks, made, HORIZON) for each in (fit, fit_continued))
    values, deviations, loose = found.values(), found.deviations(), anew.deviations()
    for name, true in TRUE.items():
        assert abs(values[name] - true) < 4 * deviations[name]
        assert deviations[name] < loose[name] / 3
    assert values["a"] == pytest.approx(TRUE["a"], rel=0.005)
    assert found.rms[0] == pytest.approx(NOISE, rel=0.1)


def test_two_starts_lead_to_one_optimum() -> None:
    made, tanks = recording(2, 1), compiled(TANKS)
    starts = tanks.parameters, tanks.vector(TRUE)
    one, other = (fit_continued(tanks, made, HORIZON, start=start) for start in starts)
    assert one.parameters == pytest.approx(other.parameters, rel=1e-4)


def test_hidden_levels_continue_within_a_recording_only() -> None:
    made, tanks = recording(0, 1), compiled(TANKS)
    found = fit_continued(tanks, made, HORIZON)
    starts = HORIZON * np.arange(len(found.initial))
    padded = np.pad(made.inputs, ((0, 1), (0, 0)), mode="edge")
    run = tanks.simulate(
        padded, EVERY, starts, HORIZON + 1, initial=found.initial, parameters=found.parameters
    )
    gap = np.abs(run.last[:-1, 0] - found.initial[1:, 0])
    join = SAMPLES // HORIZON - 1
    assert np.delete(gap, join).max() < 1e-9
    assert gap[join] > 0.1


def test_the_slopes_foresee_how_the_error_rises() -> None:
    made, tanks = recording(0, 1), compiled(TANKS)
    found = fit_continued(tanks, made, HORIZON)
    least = float(np.mean(found.error**2))
    for index in range(len(TRUE)):
        step = 5 * np.sqrt(found.covariance[index, index])
        moved = found.parameters.copy()
        moved[index] += step
        foreseen = found.error + step * found.jacobian[..., index]
        there = continued_error_at(found, made, HORIZON, 4, moved) ** 2 - least
        assert there == pytest.approx(np.mean(foreseen**2) - least, rel=0.1)


def test_sensitivities_of_the_last_states_are_slopes() -> None:
    tanks, made = compiled(TANKS), filled_tanks(0)

    def last(initial: FloatArray, parameters: FloatArray) -> FloatArray:
        run = tanks.simulate(
            made.inputs, EVERY, np.array([0]), 40, initial=initial[None], parameters=parameters
        )
        return np.column_stack([run.last[0], run.last_slopes[0]])

    start, values = np.array([6.0, 5.0]), tanks.vector(TRUE)
    slopes = last(start, values)[:, 1:]
    for column in range(slopes.shape[1]):
        step = 1e-5
        ends = []
        for sign in (-1, 1):
            initial, parameters = start.copy(), values.copy()
            if column < len(TRUE):
                parameters[column] += sign * step
            else:
                initial[column - len(TRUE)] += sign * step
            ends.append(last(initial, parameters)[:, 0])
        assert (ends[1] - ends[0]) / (2 * step) == pytest.approx(slopes[:, column], rel=1e-4)


def test_where_channels_show_all_states_nothing_changes() -> None:
    made, tanks = recording(0, 2), compiled(SHOWN)
    one, other = (each(tanks, made, HORIZON) for each in (fit, fit_continued))
    assert not other.continued
    assert np.array_equal(one.parameters, other.parameters)
    assert np.array_equal(one.error, other.error)


def test_windows_that_diverge_have_an_infinite_error() -> None:
    made = recording(0, 1)
    growing = TANKS.replace('derivative = "k*pump', 'derivative = "r*x**3 + k*pump').replace(
        "parameters.d", 'parameters.r = { value = 0.0, unit = "1/(V^2 s)" }\nparameters.d'
    )
    tanks = compiled(growing)
    found = fit(tanks, made, HORIZON)
    far = tanks.vector(found.values() | {"r": 1.0})
    assert continued_error_at(found, made, HORIZON, 1, far) == np.inf

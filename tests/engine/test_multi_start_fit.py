"""The fitting driver reaches the floor from anywhere, and says so where it does not."""

import numpy as np
import pytest
from msgspec import structs

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.model import Model, shipped_models
from rigwatch.physics.engine.equations.system import compose
from rigwatch.physics.engine.fit.recording import Recording, initial_states, joined
from rigwatch.physics.engine.fit.windowed_fit import fit
from rigwatch.physics.engine.search.convergence import promise
from rigwatch.physics.engine.search.drawn_starts import drawn_start
from rigwatch.physics.engine.search.equation_error import equation_error_starts
from rigwatch.physics.engine.search.horizons import growing_horizons
from rigwatch.physics.engine.search.multi_start_fit import multi_start_fit
from rigwatch.physics.engine.search.short_horizons import ShortHorizons
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files.loading import parse
from sim_plant.specimens.exact_mass import SAMPLES, Mass, excitation, moved

PLANT = Mass(1.0, 4.0, 400.0)
DT = 1 / 256
SEEN_BY_POSITION = """
name = "mass"
summary = "a mass on a spring, seen by its position alone"
hold = "zero"
inputs.force = { unit = "N" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(force - k*x - c*v)/m", rate_of = "position" }
parameters.m = { value = 1.0, unit = "kg", low = 1e-6 }
parameters.c = { value = 1.0, unit = "N s/m", low = 0.0 }
parameters.k = { value = 1.0, unit = "N/m", low = 0.0 }
outputs.position = { unit = "m", expression = "x" }
"""
HIDDEN_STATE = """
name = "filtered"
summary = "a gain behind a lag that no channel shows, read with a gain of its own"
hold = "linear"
inputs.command = { unit = "V" }
states.x = { unit = "V", derivative = "w*(g*command - x)" }
parameters.w = { value = 1.0, unit = "1/s", low = 1e-3, high = 1e4 }
parameters.g = { value = 1.0, unit = "1", low = 1e-3, high = 1e3 }
parameters.h = { value = 1.0, unit = "1", low = 1e-3, high = 1e3 }
outputs.y = { unit = "V", expression = "h*x" }
"""


def recorded(hold="zero", seed=1):
    generator = np.random.default_rng(seed)
    force = excitation(generator)
    read = moved(PLANT, force, held=hold == "zero")
    noise = 2e-3 * read.std(axis=0)
    made = Recording(DT, force[:, None], read + noise * generator.normal(size=read.shape))
    return made, noise


def compiled_with(hold="zero", change=lambda model: model):
    model = structs.replace(shipped_models()["mass-spring-damper"], hold=hold)
    return compile_system(compose(change(model)))


def error_over_noise(found, noise):
    return float(np.sqrt(np.mean((found.rms / noise) ** 2)))


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("horizon", [64, 1024])
@pytest.mark.parametrize("start", [(1.0, 1.0, 1.0), (1e3, 1e-3, 1e-2), (1e-3, 1e3, 4e5)])
def test_the_floor_is_reached_from_starts_six_decades_apart(start, horizon, hold):
    recording, noise = recorded(hold)
    found, ended = multi_start_fit(ShortHorizons(
        compiled_with(hold), recording, horizon, start=np.array(start), scale=noise, noise=noise,
        substeps=2,
    ))  # fmt: skip
    assert error_over_noise(found, noise) < 1.05
    assert found.parameters == pytest.approx(PLANT.values, rel=0.01)
    assert ended.converged
    assert ended.at_bound == ()


def test_a_fit_alone_does_not_reach_it_from_there():
    recording, noise = recorded()
    found = fit(
        compiled_with(), recording, 512, start=np.array([1e3, 1e-3, 1e-2]), scale=noise, substeps=2
    )
    assert error_over_noise(found, noise) > 10


def test_the_equations_balance_along_the_measured_motion():
    recording, _ = recorded()
    starts = equation_error_starts(compiled_with(), recording, np.array([1e4, 1e-4, 1.0]))
    best = min(starts, key=lambda each: abs(each[0] - 1.0))
    assert best == pytest.approx(PLANT.values, rel=0.02)


def test_without_an_accelerometer_the_rate_of_the_position_is_balanced():
    recording, _ = recorded()
    alone = Recording(DT, recording.inputs, recording.outputs[:, :1])
    seen = compile_system(compose(parse(SEEN_BY_POSITION, Model, "mass")))
    starts = equation_error_starts(seen, alone, np.ones(3))
    best = min(starts, key=lambda each: abs(each[0] - 1.0))
    assert best == pytest.approx(PLANT.values, rel=0.1)


def test_where_recordings_join_no_rate_of_change_is_made_up():
    first, second = recorded(seed=1)[0], recorded(seed=2)[0]
    peak = SAMPLES // 2 + int(np.argmax(first.outputs[SAMPLES // 2 :, 0]))
    apart = [
        Recording(DT, first.inputs[:peak], first.outputs[:peak, :1]),
        Recording(DT, second.inputs, second.outputs[:, :1]),
    ]
    whole = joined(apart)
    seen = compile_system(compose(parse(SEEN_BY_POSITION, Model, "mass")))
    for one in (0, 1):
        alone = initial_states(seen.system, apart[one])
        np.testing.assert_array_equal(initial_states(seen.system, whole)[whole.slices[one]], alone)
    best = min(equation_error_starts(seen, whole, np.ones(3)), key=lambda each: abs(each[0] - 1.0))
    assert best == pytest.approx(PLANT.values, rel=0.1)


def test_fixed_parameters_stay_in_every_start():
    def known(model):
        fixed = structs.replace(model.parameters["m"], fixed=True)
        return structs.replace(model, parameters=model.parameters | {"m": fixed})

    recording, _ = recorded()
    starts = equation_error_starts(compiled_with(change=known), recording, np.array([2.0, 1, 1]))
    assert starts
    assert all(each[0] == 2.0 for each in starts)


def test_gaps_in_a_channel_do_not_spoil_the_balance():
    recording, _ = recorded()
    outputs = recording.outputs.copy()
    outputs[1000:1400] = np.nan
    holed = Recording(DT, recording.inputs, outputs)
    best = min(
        equation_error_starts(compiled_with(), holed, np.ones(3)), key=lambda each: abs(each[0] - 1)
    )
    assert best == pytest.approx(PLANT.values, rel=0.02)


def lagged():
    command = excitation(np.random.default_rng(3))
    x, w = np.zeros(SAMPLES), 30.0
    share = np.exp(-w * DT)
    lift = 1 - (1 - share) / (w * DT)
    for k in range(SAMPLES - 1):
        step = command[k + 1] - command[k]
        x[k + 1] = share * x[k] + (1 - share) * 2.0 * command[k] + lift * 2.0 * step
    noise = 2e-3 * x.std()
    return Recording(DT, command[:, None], (x + noise * np.random.default_rng(4).normal(
        size=SAMPLES))[:, None]), np.array([noise])  # fmt: skip


def test_a_hidden_state_is_reached_by_growing_horizons_and_what_is_open_is_reported():
    recording, noise = lagged()
    compiled = compile_system(compose(parse(HIDDEN_STATE, Model, "filtered")))
    start = np.array([3000.0, 1e-2, 1e-2])
    assert equation_error_starts(compiled, recording, start) == []
    found, ended = multi_start_fit(
        ShortHorizons(compiled, recording, 256, start=start, scale=noise, noise=noise, substeps=2)
    )
    assert error_over_noise(found, noise) < 1.1
    assert ended.converged
    assert found.values()["w"] == pytest.approx(30.0, rel=0.02)
    # Only the product of both gains shows.
    assert set(ended.undetermined) == {"g", "h"}


def test_a_parameter_at_its_bound_is_named():
    def stiff(model):
        low = structs.replace(model.parameters["k"], low=500.0)
        return structs.replace(model, parameters=model.parameters | {"k": low})

    recording, noise = recorded()
    _, ended = multi_start_fit(
        ShortHorizons(
            compiled_with(change=stiff), recording, 128, scale=noise, noise=noise, substeps=2
        )
    )
    assert ended.at_bound == ("k",)


def test_a_step_that_was_not_taken_is_promised():
    recording, noise = recorded()
    found = fit(compiled_with(), recording, 64, start=PLANT.values, scale=noise, substeps=2)
    assert promise(found) < 1e-4
    off = fit(
        compiled_with(change=_all_fixed), recording, 64, start=1.02 * PLANT.values, scale=noise,
        substeps=2,
    )  # fmt: skip
    assert promise(off) == 0.0


def _all_fixed(model):
    fixed = {name: structs.replace(p, fixed=True) for name, p in model.parameters.items()}
    return structs.replace(model, parameters=fixed)


def test_drawn_starts_keep_to_the_bounds():
    system = compose(shipped_models()["servo-pneumatic"])
    begin = np.array([p.value for p in system.parameters.values()])
    generator = np.random.default_rng(0)
    for _ in range(20):
        found = drawn_start(system, begin, generator)
        for value, first, (name, p) in zip(found, begin, system.parameters.items(), strict=True):
            assert p.low <= value <= p.high
            assert name in system.free or value == first


def test_horizons_grow_from_a_few_samples_to_the_whole():
    assert growing_horizons(1024) == [16, 64, 256]
    assert growing_horizons(8) == []


def test_what_blows_up_from_everywhere_is_an_error():
    recording, noise = recorded()
    spoiled = Recording(DT, recording.inputs * 1e306, recording.outputs)
    with pytest.raises(ModelError):
        multi_start_fit(
            ShortHorizons(compiled_with(), spoiled, 64, scale=noise, noise=noise, substeps=2)
        )

"""The engine: exact sensitivities, fits that recover what was put in, errors that help."""

import numpy as np
import pytest
import scipy.interpolate
import scipy.signal
from msgspec.structs import replace

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.compile.step_size import pace
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.expression_dimension import dimension
from rigwatch.physics.engine.equations.model import Model, shipped_models
from rigwatch.physics.engine.equations.quantities import spelt_out
from rigwatch.physics.engine.equations.scope import symbol
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.windowed_fit import evaluate, fit
from rigwatch.physics.engine.score.compatibility import suits
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files.loading import parse
from rigwatch.wire.units import describe

MASS_SPRING_DAMPER = shipped_models()["mass-spring-damper"]
DT = 1 / 256
SAMPLES = 600
TRUE = {"m": 0.8, "c": 1.5, "k": 60.0}


def excitation(seed: int = 1, samples: int = SAMPLES) -> np.ndarray:
    rng = np.random.default_rng(seed)
    time, band = np.arange(samples) * DT, np.arange(0.5, 8, 0.5)
    waves = np.cos(2 * np.pi * np.outer(time, band) + rng.uniform(0, 2 * np.pi, len(band)))
    return 4.0 * waves.sum(axis=1, keepdims=True)


def simulated(compiled, values, u, noise=0.0, seed=0):
    run = compiled.simulate(
        u, DT, np.array([0]), len(u), initial=np.zeros((1, len(compiled.system.states))),
        parameters=compiled.vector(values),
    )  # fmt: skip
    clean = run.outputs[0]
    noisy = clean + noise * clean.std(axis=0) * np.random.default_rng(seed).normal(size=clean.shape)
    return Recording(DT, u, noisy)


SIZES = {"x": 0.1, "v": 1.0, "L": 6.0, "u": 0.2, "rate": 2.0, "dt": DT, "p": 1.0}
GENTLE = {"vs": 0.05, "tau": 2 * DT, "td": 0.001}


def ready(name):
    """The effect for signals of the test's size, smooth enough for finite differences."""
    effect = library()[name].scaled(SIZES)
    gentle = {n: GENTLE[n] for n in effect.parameters if n in GENTLE}
    changed = {n: replace(effect.parameters[n], value=value) for n, value in gentle.items()}
    return replace(effect, parameters=effect.parameters | changed)


def home(effect):
    """The port of the mass-spring-damper where an effect is tested; a leak has a chamber's."""
    ports = MASS_SPRING_DAMPER.ports
    return next(name for name, port in ports.items() if suits(effect, port, MASS_SPRING_DAMPER))


def everything():
    """Every effect that a mass-spring-damper can have; those with memory and the smooth ones."""
    ports = MASS_SPRING_DAMPER.ports.values()
    return sorted(
        name
        for name, effect in library().items()
        if any(suits(effect, port, MASS_SPRING_DAMPER) for port in ports)
    )


JUMPING = {"quantisation"}


@pytest.mark.parametrize("name", [name for name in everything() if name not in JUMPING])
def test_sensitivities_agree_with_finite_differences(name):
    effect = ready(name)
    port = home(effect)
    compiled = compile_system(compose(MASS_SPRING_DAMPER, [Placement(name, effect, port)]))
    system, u = compiled.system, excitation(samples=80)
    strength = f"{port}_{name}_{effect.strength}"
    given = {strength: 0.4} if effect.parameters[effect.strength].role == "strength" else {}
    if effect.family == "late signal":
        given |= {f"{port}_{name}_{p}": 2 * DT for p in effect.parameters if p.endswith("tau")}
    base = compiled.vector({**TRUE, **given})
    initial = np.full((1, len(system.states)), 0.013)

    def outputs(parameters):
        run = compiled.simulate(
            u, DT, np.array([0]), len(u), initial=initial, parameters=parameters
        )
        return run.outputs, run.slopes

    _, slopes = outputs(base)
    for column, parameter in enumerate(system.free):
        index = list(system.parameters).index(parameter)
        step = np.zeros(len(base))
        step[index] = 1e-5 * max(abs(base[index]), 1e-2)
        difference = (outputs(base + step)[0] - outputs(base - step)[0]) / (2 * step[index])
        # A kink between two samples is stepped over differently: it may show at single samples.
        wrong, size = slopes[..., column] - difference, np.sqrt(np.mean(difference**2))
        assert np.sqrt(np.mean(wrong**2)) <= 2e-3 * size + 1e-9, parameter


@pytest.mark.parametrize("samples", [0.5, 3.0, 8.0])
def test_a_delay_shifts_and_leaves_the_signal_whole(samples):
    effect, u = ready("delay"), excitation()
    placed = compose(MASS_SPRING_DAMPER, [Placement("delay", effect, "position_sensor")])
    compiled = compile_system(placed)
    given = {**TRUE, "position_sensor_delay_tau": samples * DT}
    late = simulated(compiled, given, u).outputs[:, 0]
    whole = simulated(compile_system(compose(MASS_SPRING_DAMPER)), TRUE, u).outputs[:, 0]
    time = np.arange(SAMPLES) * DT
    shifted = np.interp(time - samples * DT, time, whole)
    assert np.abs(late - shifted).max() < 2e-3 * np.abs(whole).max()


def test_a_delay_of_a_small_part_of_a_sample_shifts_as_much_and_takes_few_steps():
    tau = 0.05 * DT
    system = compose(MASS_SPRING_DAMPER, [Placement("delay", ready("delay"), "position_sensor")])
    given, u = {**TRUE, "position_sensor_delay_tau": tau}, excitation()
    late = simulated(compile_system(system), given, u).outputs[:, 0]
    whole = simulated(compile_system(compose(MASS_SPRING_DAMPER)), TRUE, u).outputs[:, 0]
    time = np.arange(SAMPLES) * DT
    moved = scipy.interpolate.CubicSpline(time, whole)(time - tau) - whole
    assert np.abs(late - whole - moved)[1:].max() < 0.02 * np.abs(moved).max()
    values = {symbol(n): given.get(n, p.value) for n, p in system.parameters.items()}
    assert max(abs(float(rate.subs(values))) for rate in pace(system).asked) * DT <= 50.001


def test_simulation_agrees_with_the_closed_form():
    compiled = compile_system(compose(MASS_SPRING_DAMPER))
    u = excitation()
    ours = simulated(compiled, TRUE, u).outputs[:, 0]
    plant = scipy.signal.lti([1.0], [TRUE["m"], TRUE["c"], TRUE["k"]])
    _, theirs, _ = scipy.signal.lsim(plant, u[:, 0], np.arange(SAMPLES) * DT)
    assert np.abs(ours - theirs).max() < 1e-6 * np.abs(theirs).max()


def test_a_fit_recovers_parameters_within_their_deviations():
    compiled = compile_system(compose(MASS_SPRING_DAMPER))
    found = fit(compiled, simulated(compiled, TRUE, excitation(), noise=0.01), horizon=128)
    for name, deviation in found.deviations().items():
        assert abs(found.values()[name] - TRUE[name]) < 5 * deviation


def test_adding_the_missing_effect_lowers_the_error_on_other_data():
    friction = Placement("coulomb", library()["coulomb"], "load")
    plant = compile_system(compose(MASS_SPRING_DAMPER, [friction]))
    truth = TRUE | {"load_coulomb_Fc": 0.8}
    train = simulated(plant, truth, excitation(1), noise=0.005, seed=1)
    held_out = simulated(plant, truth, excitation(2), noise=0.005, seed=2)
    without = fit(compile_system(compose(MASS_SPRING_DAMPER)), train, horizon=128)
    added = fit(plant, train, horizon=128)
    error = [evaluate(found, held_out, horizon=128).rms[1] for found in (without, added)]
    assert error[1] < 0.3 * error[0]
    assert added.values()["load_coulomb_Fc"] == pytest.approx(0.8, rel=0.05)


def test_samples_that_are_not_numbers_are_left_out():
    compiled = compile_system(compose(MASS_SPRING_DAMPER))
    recording = simulated(compiled, TRUE, excitation())
    recording.outputs[100:120] = np.nan
    found = fit(compiled, recording, horizon=128)
    assert found.values()["k"] == pytest.approx(TRUE["k"], rel=1e-4)


MISTAKES = [
    ("k*x", "k*y", "state v: found the unknown name 'y'"),
    ("k*x", "k*v", "state v: found 'drive - k * v' with units"),
    ("k*x", "k*x*(", "breaks off"),
    ("- c*v", "- exp(c)*v", "expected a pure number"),
]


@pytest.mark.parametrize(("right", "wrong", "said"), MISTAKES, ids=[m[1] for m in MISTAKES])
def test_a_wrong_equation_is_named(right, wrong, said):
    model = spelt_out(MASS_SPRING_DAMPER)
    state = model.states["v"]
    broken = replace(state, derivative=state.derivative.replace(right, wrong))
    model = replace(model, states=model.states | {"v": broken})
    with pytest.raises(ModelError, match=r"state v|expected") as error:
        compose(model)
    assert said in str(error.value)


def test_an_effect_at_the_wrong_port_is_refused():
    coulomb = library()["coulomb"]
    with pytest.raises(ModelError, match="of kind actuator, expected kind force"):
        compose(MASS_SPRING_DAMPER, [Placement("coulomb", coulomb, "drive")])
    with pytest.raises(ModelError, match="expected one of drive, load"):
        compose(MASS_SPRING_DAMPER, [Placement("coulomb", coulomb, "laod")])


def test_a_model_without_states_is_a_regression():
    text = """
name = "line"
summary = "a line"
inputs.u = { unit = "V" }
parameters.slope = { value = 1.0, unit = "1" }
outputs.y = { unit = "V", expression = "slope*u" }
"""
    u = excitation()
    found = fit(compile_system(compose(parse(text, Model, "line"))), Recording(DT, u, 3 * u), 100)
    assert found.values()["slope"] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("one", "other"), [("N s/m", "N/(m/s)"), ("Pa", "N/m^2"), ("J", "N m"), ("1/s", "Hz")]
)
def test_units_that_are_the_same_have_one_dimension(one, other):
    assert dimension(one) == dimension(other)


def test_an_unknown_unit_is_named():
    with pytest.raises(ModelError, match="'furlong'"):
        dimension("furlong")
    assert describe(dimension("m/s^2")) == "m s^-2"


def test_a_simulation_that_blows_up_does_not_count_as_missing_samples():
    text = """
name = "runaway"
summary = "a state that grows beyond all numbers"
inputs.u = { unit = "1" }
states.x = { unit = "1", derivative = "k*x**3 + u", start = 1.0 }
parameters.k = { value = 1.0, unit = "1/s", fixed = true }
outputs.y = { unit = "1", expression = "x" }
""".replace('derivative = "k*x**3 + u"', 'derivative = "k*(x**3 + u)"')
    compiled = compile_system(compose(parse(text, Model, "runaway")))
    recording = Recording(0.1, np.ones((80, 1)), np.ones((80, 1)))
    with pytest.raises(ModelError, match="diverged"):
        fit(compiled, recording, 80)


DRAINED = """
name = "drained"
summary = "a tank that drains, its hole above what is left in the end"
inputs.u = { unit = "m/s" }
states.h = { unit = "m", derivative = "u - a*sqrt(max(h, 0)) - leak", measured = "level" }
parameters.a = { value = 0.5, unit = "m^0.5/s", low = 0.0 }
parameters.leak = { value = 0.1, unit = "m/s", fixed = true }
outputs.level = { unit = "m", expression = "h" }
"""


def test_a_flow_that_has_ended_leaves_the_slopes_finite_and_right():
    compiled = compile_system(compose(parse(DRAINED, Model, "drained")))
    u = np.where(np.arange(400) < 200, 0.0, 0.4)[:, None]

    def run(a: float):
        return compiled.simulate(
            u, 0.02, np.array([0]), 400, initial=np.ones((1, 1)),
            parameters=compiled.vector({"a": a}),
        )  # fmt: skip

    at, step = run(0.8), 1e-5
    assert at.outputs[0, :, 0].min() < -0.05, "it drains below the hole"
    found = (run(0.8 + step).outputs - run(0.8 - step).outputs)[0, :, 0] / (2 * step)
    # Where the flow ends, the error of a step does not fall with the difference.
    assert np.abs(at.slopes[0, :, 0, 0] - found).max() < 0.02 * np.abs(found).max()
    read = at.outputs[0] + 0.01 * np.random.default_rng(0).normal(size=(400, 1))
    fitted = fit(compiled, Recording(0.02, u, read), horizon=400)
    assert fitted.values()["a"] == pytest.approx(0.8, rel=0.02)


THROTTLED = """
name = "throttled"
summary = "a tank whose loss grows with the size of the net flow into it"
inputs.u = { unit = "m/s" }
states.h = { unit = "m", derivative = "u - a*sqrt(h + d) - LOSS", measured = "level" }
parameters.a = { value = 0.5, unit = "m^0.5/s", low = 0.0 }
parameters.b = { value = 0.3, unit = "s/m", low = 0.0 }
parameters.d = { value = 0.5, unit = "m", fixed = true }
parameters.w = { value = 0.1, unit = "m/s", fixed = true }
outputs.level = { unit = "m", expression = "h" }
"""
NET = "(u - a*sqrt(h + d))"


@pytest.mark.parametrize(
    "loss",
    [
        pytest.param(f"b*{NET}*abs{NET}", id="a product"),
        pytest.param(f"b*w*w*tanh(abs{NET}/w)", id="within a function"),
        pytest.param(f"b*w*max(abs{NET} - w, 0)", id="of which a part counts"),
    ],
)
def test_the_size_of_a_flow_through_a_root_has_slopes(loss):
    text = THROTTLED.replace("LOSS", loss)
    compiled = compile_system(compose(parse(text, Model, "throttled")))
    u = 0.4 + 0.4 * np.sin(np.arange(300) * 0.05)[:, None]

    def run(b: float):
        return compiled.simulate(
            u, 0.02, np.array([0]), 300, initial=np.ones((1, 1)),
            parameters=compiled.vector({"b": b}),
        )  # fmt: skip

    step = 1e-5
    found = (run(0.3 + step).outputs - run(0.3 - step).outputs)[0, :, 0] / (2 * step)
    place = compiled.system.free.index("b")
    # What a threshold passes has a corner, whose place a step moves.
    assert np.abs(run(0.3).slopes[0, :, 0, place] - found).max() < 1e-3 * np.abs(found).max()

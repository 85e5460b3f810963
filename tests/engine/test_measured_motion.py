"""Prediction along the measured motion, against motions that SciPy integrates."""

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.integrate import solve_ivp

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.measured_motion import (
    along_measured_motion,
    has_hidden_states,
    is_level_known,
    predicted_outputs,
    sensor_states,
    unjudged_along_motion,
    unmoved_at_rest,
)
from rigwatch.physics.engine.equations.model import (
    Input,
    Model,
    Output,
    Parameter,
    Port,
    State,
    Variable,
    shipped_models,
)
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.equations.variants import with_variants
from rigwatch.physics.engine.fit.measured_recording import motion_recording
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.smoothing import best_width, smoothed
from rigwatch.physics.engine.fit.windowed_fit import Fit, fit
from rigwatch.physics.engine.search.convergence import Convergence
from rigwatch.physics.engine.search.multi_start_fit import multi_start_fit
from rigwatch.physics.engine.search.whole_runs import WholeRuns
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

MASS, SPRING, DAMPER, FORCE_A_VOLT, LATE = 2.0, 300.0, 3.0, 5.0, 0.02
RATE = 500.0


def _actuated_mass() -> Model:
    """A mass on a spring that a slow actuator pushes; the actuator's force is hidden."""
    balance = "(f - k*x - c*v + load)/m"
    variables = {n: Variable(expression=n, unit=u) for n, u in (("x", "m"), ("v", "m/s"))}
    return Model(
        name="actuated-mass",
        summary="a mass that a slow actuator pushes",
        inputs={"u": Input(unit="V")},
        states={
            "x": State(unit="m", derivative="v", measured="position"),
            "v": State(unit="m/s", derivative=balance, rate_of="position"),
            "f": State(unit="N", derivative="(K*drive - f)/T"),
        },
        parameters={
            "m": Parameter(value=MASS, unit="kg", fixed=True),
            "k": Parameter(value=SPRING, unit="N/m"),
            "c": Parameter(value=DAMPER, unit="N s/m"),
            "K": Parameter(value=FORCE_A_VOLT, unit="N/V"),
            "T": Parameter(value=LATE, unit="s", low=1e-3, high=1.0),
        },
        outputs={
            "position": Output(unit="m", expression="x"),
            "acceleration": Output(unit="m/s^2", expression=balance),
        },
        ports={
            "drive": Port(kind="actuator", signal="u"),
            "load": Port(kind="force", unit="N", variables=variables),
            "position_sensor": Port(kind="sensor", signal="position"),
            "acceleration_sensor": Port(kind="sensor", signal="acceleration"),
        },
    )


def _drive(t: FloatArray) -> FloatArray:
    return np.asarray(3 * np.sin(9 * t) + 2 * np.sin(23 * t + 1))


def _measured(friction: float = 0.0, seconds: float = 6.0, noise: float = 0.0) -> Recording:
    """What the actuated mass does, with dry friction that the model does not know."""

    def balance(v: FloatArray, x: FloatArray, f: FloatArray) -> FloatArray:
        slide = friction * np.tanh(v / 1e-3)
        return np.asarray((f - SPRING * x - DAMPER * v - slide) / MASS)

    def rates(t: float, z: FloatArray) -> list[float]:
        x, v, f = z
        drive = float(_drive(np.array(t)))
        return [v, float(balance(v, x, f)), (FORCE_A_VOLT * drive - f) / LATE]

    t = np.arange(round(seconds * RATE)) / RATE
    found = solve_ivp(rates, (0, t[-1]), [0.01, 0, 2.0], t_eval=t, rtol=1e-9, atol=1e-12)
    x, v, f = found.y
    rng = np.random.default_rng(3)
    outputs = np.column_stack([x, balance(v, x, f)])
    outputs += noise * outputs.std(axis=0) * rng.standard_normal(outputs.shape)
    return Recording(1 / RATE, _drive(t)[:, None], outputs)


def _fitted(model: Model, recording: Recording, *placed: Placement) -> Fit:
    """A model with effects, fitted along the motion of a recording."""
    compiled = compile_system(compose(along_measured_motion(model), placed))
    motion = motion_recording(model, recording)
    return fit(compiled, motion, len(motion), scale=np.ones(1))


def _as_it_is(model: Model) -> Model:
    """The model with nothing left to be fitted."""
    known = {name: replace(p, fixed=True) for name, p in model.parameters.items()}
    return replace(model, parameters=known)


def test_prediction_is_the_acceleration() -> None:
    model, recording = _actuated_mass(), _measured()

    left = _fitted(_as_it_is(model), recording)

    assert left.rms[0] < 1e-4 * recording.outputs[:, 1].std()


def test_residual_is_the_missing_force_over_the_mass() -> None:
    recording = _measured(friction=0.4)

    left = _fitted(_as_it_is(_actuated_mass()), recording).residuals[0, :, 0] * MASS

    speed = smoothed(recording.outputs[:, 0], 1 / RATE, 5, 1)
    # The unknown first force of the actuator takes some of it, until that is forgotten.
    settled = np.arange(len(left)) / RATE > 10 * LATE
    sliding = np.isfinite(left) & settled & (np.abs(speed) > 0.02)
    assert np.allclose(left[sliding], -0.4 * np.sign(speed[sliding]), atol=0.02)


def test_measured_states_become_inputs() -> None:
    model = along_measured_motion(_actuated_mass())

    assert list(model.inputs) == ["u", "x", "v"]
    assert list(model.states) == ["f"]
    assert list(model.outputs) == ["acceleration"]
    assert list(model.ports) == ["drive", "load", "acceleration_sensor"]


def test_an_effect_is_fitted_along_the_motion() -> None:
    recording = _measured(friction=0.4, noise=0.002)
    coulomb = library()["coulomb"].scaled({"x": 0.02, "v": 0.2})

    found = _fitted(_actuated_mass(), recording, Placement("coulomb", coulomb, "load"))

    assert found.values()["load_coulomb_Fc"] == pytest.approx(0.4, rel=0.03)
    assert found.values()["k"] == pytest.approx(SPRING, rel=0.01)


def test_input_that_is_kept_stays_kept() -> None:
    model = along_measured_motion(shipped_models()["servo-pneumatic"])

    assert model.held("voltage") == "zero"
    assert model.held("x") == model.held("v") == "linear"
    assert list(model.states) == ["P1", "P2", "s", "r", "mean"]


@pytest.mark.parametrize("speed", [0.0, 0.01])
def test_what_follows_the_acceleration_is_not_moved_by_a_push_at_rest(speed: float) -> None:
    plain = shipped_models()["servo-pneumatic"]
    fixed = {name: replace(p, fixed=True) for name, p in plain.parameters.items()}
    model = replace(plain, parameters=fixed)
    means = []
    for each in (model, unmoved_at_rest(model)):
        compiled = compile_system(compose(along_measured_motion(each)))
        rows, states = np.tile([0.5, 0.0, speed], (256, 1)), compiled.system.states
        start = np.array([[state.start for state in states.values()]])
        run = compiled.simulate(
            rows, 1 / 256, np.zeros(1, np.int64), len(rows),
            initial=start, parameters=compiled.vector({}),
        )  # fmt: skip
        means.append(run.last[0][list(states).index("mean")])

    assert abs(means[0]) > 1.0
    assert means[1] == pytest.approx(0.0 if speed == 0.0 else means[0], abs=1e-9)


def test_a_balance_rests_at_a_level_of_its_own_where_its_mean_is_taken_away() -> None:
    plain = shipped_models()["servo-pneumatic"]
    fixed = {name: replace(p, fixed=True) for name, p in plain.parameters.items()}
    open_level = unmoved_at_rest(replace(plain, parameters=fixed), level_known=False)
    compiled = compile_system(compose(along_measured_motion(open_level)))
    names = list(compiled.system.states)
    start = np.array([[state.start for state in compiled.system.states.values()]])
    start[0, names.index("acceleration_at_rest")] = 3.0
    run = compiled.simulate(
        np.tile([0.5, 0.0, 0.0], (1024, 1)), 1 / 256, np.zeros(1, np.int64), 1024,
        initial=start, parameters=compiled.vector({}),
    )  # fmt: skip

    assert run.last[0][names.index("mean")] == pytest.approx(3.0, rel=1e-4)
    assert run.last[0][names.index("acceleration_at_rest")] == 3.0
    assert not is_level_known(open_level)
    assert is_level_known(unmoved_at_rest(plain))


def test_a_balance_rests_at_zero_where_a_sensor_shows_its_mean() -> None:
    plain = shipped_models()["mass-spring-damper"]
    assert unmoved_at_rest(plain, level_known=False) == unmoved_at_rest(plain)
    assert is_level_known(unmoved_at_rest(plain, level_known=False))


def test_positions_alone_are_predicted_as_a_balance() -> None:
    shown = shipped_models()["mass-spring-damper"]
    model = replace(
        shown,
        outputs={"position": shown.outputs["position"]},
        ports={n: p for n, p in shown.ports.items() if n != "acceleration_sensor"},
        parameters=shown.parameters | {"m": Parameter(value=MASS, unit="kg", fixed=True)},
    )
    assert not predicted_outputs(model)
    assert not has_hidden_states(model)

    t = np.arange(5000) / RATE
    x = 0.02 * np.sin(7 * t) + 0.01 * np.sin(19 * t)
    v = 0.14 * np.cos(7 * t) + 0.19 * np.cos(19 * t)
    a = -0.98 * np.sin(7 * t) - 3.61 * np.sin(19 * t)
    force = MASS * a + DAMPER * v + SPRING * x
    noisy = x + 2e-5 * np.random.default_rng(5).standard_normal(len(x))
    motion = motion_recording(model, Recording(1 / RATE, force[:, None], noisy[:, None]))
    compiled = compile_system(compose(along_measured_motion(model)))

    found = fit(compiled, motion, len(motion)).values()

    assert found["k"] == pytest.approx(SPRING, rel=0.01)
    assert found["c"] == pytest.approx(DAMPER, rel=0.03)


def test_samples_beside_a_gap_and_at_the_ends_are_not_counted() -> None:
    recording = _measured(seconds=1.0)
    recording.outputs[200:203, 0] = np.nan

    motion = motion_recording(_actuated_mass(), recording, widths={"position": 9})

    missing = np.flatnonzero(np.isnan(motion.outputs[:, 0])).tolist()
    assert missing == [*range(4), *range(196, 207), *range(496, 500)]
    assert np.isfinite(motion.inputs).all()


def test_parts_are_smoothed_apart_and_settle_apart() -> None:
    one = _measured(seconds=1.0)
    outputs = np.concatenate([one.outputs, one.outputs + np.array([0.5, 0.0])])
    both = Recording(one.dt, np.concatenate([one.inputs, one.inputs]), outputs)

    motion = motion_recording(
        _actuated_mass(), both, parts=(500, 500), settling=0.1, widths={"position": 9}
    )

    assert np.allclose(motion.inputs[:500, 2], motion.inputs[500:, 2], atol=1e-9)
    assert np.isnan(motion.outputs[500:550]).all()
    assert np.isfinite(motion.outputs[550:990]).all()


def test_nothing_counts_of_a_part_that_is_shorter_than_the_smoothing() -> None:
    whole = _measured(seconds=1.1)
    both = Recording(whole.dt, whole.inputs[:520], whole.outputs[:520])

    motion = motion_recording(_actuated_mass(), both, parts=(500, 20), widths={"position": 41})

    assert np.flatnonzero(np.isfinite(motion.outputs[:, 0])).tolist() == list(range(20, 480))


@pytest.mark.parametrize("order", [0, 1, 2])
def test_smoothing_is_as_wide_as_noise_asks(order: int) -> None:
    t = np.arange(4000) / 256
    true = np.sin(2 * np.pi * 3 * t)
    rng = np.random.default_rng(1)
    widths = [
        best_width(true + noise * rng.standard_normal(len(t)), order) for noise in (1e-6, 1e-3, 0.1)
    ]

    assert widths == sorted(widths)
    assert widths[0] <= 9
    assert widths[-1] > 15


def test_model_without_measured_states_is_refused() -> None:
    model = _actuated_mass()
    hidden = {n: State(unit=s.unit, derivative=s.derivative) for n, s in model.states.items()}
    blind = replace(model, states=hidden)

    with pytest.raises(ModelError, match="no measured state"):
        along_measured_motion(blind)


def _fitted_from_afar(t_high: float) -> tuple[Fit, Convergence]:
    """The actuated mass, its parameters started a factor of two off, fitted along the motion."""
    model = _actuated_mass()
    slow = replace(model.parameters["T"], high=t_high)
    model = replace(model, parameters=model.parameters | {"T": slow})
    recording = _measured(noise=0.01)
    compiled = compile_system(compose(along_measured_motion(model)))
    motion = motion_recording(model, recording)
    start = compiled.vector(
        {"k": 2 * SPRING, "c": DAMPER / 2, "K": 2 * FORCE_A_VOLT, "T": LATE / 2}
    )
    noise = 0.01 * recording.outputs[:, 1:].std(axis=0)
    return multi_start_fit(WholeRuns(compiled, [motion], noise, start=start))


def test_fit_along_the_motion_says_that_it_converged() -> None:
    found, ended = _fitted_from_afar(t_high=1.0)

    assert found.values()["T"] == pytest.approx(LATE, rel=0.05)
    assert ended.converged
    assert ended.gradient < 0.02
    assert ended.at_bound == ()


def test_fit_along_the_motion_names_what_sits_on_a_bound() -> None:
    _, ended = _fitted_from_afar(t_high=0.75 * LATE)

    assert ended.at_bound == ("T",)


def test_sensor_states_are_those_that_no_other_state_needs() -> None:
    rig = shipped_models()["servo-pneumatic"]
    assert sensor_states(rig) == {"mean"}
    assert sensor_states(with_variants(rig, ["coupled_twice"])) == {"mean", "second_mean"}
    # The actuator's force moves the mass.
    assert sensor_states(_actuated_mass()) == frozenset()


def test_a_parameter_that_moves_only_measured_states_is_lost_along_the_motion() -> None:
    model = _actuated_mass()
    assert unjudged_along_motion(model) == frozenset()
    # Only the force's own gauge is left to predict: it shows nothing of what the mass does.
    gauge = Output(unit="N", expression="f")
    shown = replace(model, outputs={"position": model.outputs["position"], "force": gauge})
    assert unjudged_along_motion(shown) == {"k", "c"}

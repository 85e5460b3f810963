"""Windows begin where they should: memory as its input led it, stray states brought back."""

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import Model, shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.problem import Problem
from rigwatch.physics.engine.fit.recording import Recording, apart, initial_states
from rigwatch.physics.engine.fit.windowed_fit import evaluate, fit
from rigwatch.physics.engine.score.candidates import shaped
from rigwatch.physics.engine.score.effect_sensitivities import directions
from rigwatch.physics.engine.score.trajectory import trajectory
from rigwatch.physics.transfer import Derivative
from rigwatch.wire.typed_files.loading import parse

DT, N, HORIZON, RATE, FAST = 1 / 256, 1024, 128, 60.0, 50.0
FOLLOWER = """
name = "follower"
summary = "a first-order lag behind a command that is kept from sample to sample"
hold = "zero"
inputs.command = { unit = "V" }
states.x = { unit = "V", derivative = "w*(drive - x)", measured = "y" }
parameters.w = { value = 50.0, unit = "1/s", low = 1.0 }
outputs.y = { unit = "V", expression = "x" }
ports.drive = { kind = "actuator", signal = "command" }
"""
WRAPPED = """
name = "wrapped"
summary = "an angle that is seen through a curve with many hills"
inputs.speed = { unit = "1/s" }
states.angle = { unit = "1", derivative = "k*speed" }
parameters.k = { value = 1.0, unit = "1" }
outputs.y = { unit = "1", expression = "angle + 1.5*sin(3*angle)" }
"""
TURNING = """
name = "turning"
summary = "a shaft whose teeth are seen sharply, and its turns roughly"
inputs.speed = { unit = "1/s" }
states.angle = { unit = "1", derivative = "k*speed" }
parameters.k = { value = 1.0, unit = "1" }
outputs.tooth = { unit = "1", expression = "cos(8*angle)" }
outputs.turn = { unit = "1", expression = "angle" }
"""
CHARGED = """
name = "charged"
summary = "a slow level that a fast charge once fed, both seen"
inputs.speed = { unit = "1/s" }
states.level = { unit = "1", derivative = "slow*(k*speed - level) + slow*charge**2" }
states.charge = { unit = "1", derivative = "-fast*charge", start = 1.0 }
parameters.k = { value = 1.0, unit = "s" }
parameters.slow = { value = 0.5, unit = "1/s", fixed = true }
parameters.fast = { value = 20.0, unit = "1/s", fixed = true }
outputs.y = { unit = "1", expression = "level + charge" }
"""


def limited(command: np.ndarray, most: float) -> np.ndarray:
    """What a controller lets through that moves by at most `most` a sample."""
    out, at = np.empty_like(command), 0.0
    for k, wanted in enumerate(command):
        at += np.clip(wanted - at, -most, most)
        out[k] = at
    return out


def followed(driven: np.ndarray) -> np.ndarray:
    """The lag's answer to a command that jumps at samples: its closed form."""
    share, x = 1 - np.exp(-FAST * DT), np.zeros(len(driven))
    for k in range(1, len(driven)):
        x[k] = x[k - 1] + share * (driven[k - 1] - x[k - 1])
    return x


@pytest.fixture
def recording() -> Recording:
    t = DT * np.arange(N)
    command = 2 * np.sin(2 * np.pi * 4 * t) + np.sin(2 * np.pi * 9 * t + 1)
    return Recording(DT, command[:, None], followed(limited(command, RATE * DT))[:, None])


def test_a_limiter_that_steps_with_the_samples_is_followed_to_its_rate(recording):
    placement = Placement("rate_limit", library()["rate_limit"].scaled(sizes(recording)), "drive")
    compiled = compile_system(compose(parse(FOLLOWER, Model, "follower"), [placement]))
    start = compiled.vector({"drive_rate_limit_w": 1.0, "drive_rate_limit_rm": 80.0})
    found = fit(compiled, recording, HORIZON, start=start, substeps=4)
    assert found.values()["drive_rate_limit_rm"] == pytest.approx(RATE, rel=0.01)
    assert found.values()["w"] == pytest.approx(FAST, rel=0.01)
    assert found.rms[0] < 0.01 * recording.outputs.std()


def test_the_score_sees_the_same_limiter(recording):
    compiled = compile_system(compose(parse(FOLLOWER, Model, "follower")))
    at = trajectory(
        compiled, recording.inputs, DT, np.arange(0, N, HORIZON), HORIZON,
        initial=recording.outputs[::HORIZON], parameters=compiled.parameters,
    )  # fmt: skip
    effect = library()["rate_limit"].scaled(sizes(recording))
    near = min(shaped("rate_limit", effect, "drive"), key=lambda c: abs(c.shape["rm"] - RATE))
    moved = directions(at, [near])[..., 0, 0].ravel()
    command = recording.inputs[:, 0]
    wanted = followed(limited(command, near.shape["rm"] * DT)) - followed(command)
    # Each window begins in a state that has been measured: what came before it does not count.
    late = np.arange(N) % HORIZON > 40
    assert np.corrcoef(moved[late], wanted[late])[0, 1] > 0.99


def test_a_fast_state_that_is_forgotten_does_not_hide_where_a_slow_one_begins():
    compiled = compile_system(compose(parse(CHARGED, Model, "charged")))
    noise = 0.01 * np.random.default_rng(2).normal(size=N)
    y = 3.0 * np.exp(-0.5 * DT * np.arange(N)) + noise
    # When the samples begin to count, 1e-9 of the charge is left, and noise asks for 1e5 of it.
    y[: N // 4] = np.nan
    slow = Recording(DT, np.zeros((N, 1)), y[:, None])
    problem = Problem(
        compiled, slow, N, scale=np.array([0.01]), substeps=2, initial=np.array([[1.0, 1.0]])
    )
    problem.recall(compiled.parameters)
    problem.settle(compiled.parameters)
    assert problem.initial[0, 0] == pytest.approx(3.0, abs=0.1)


def test_a_window_whose_initial_state_went_astray_begins_where_the_one_before_ended():
    compiled = compile_system(compose(parse(WRAPPED, Model, "wrapped")))
    speed = np.zeros((800, 1))
    speed[320:380], speed[420:480] = 4.0, -4.0
    angle = 1.1 * 0.01 * np.concatenate([[0.0], np.cumsum(speed[:-1] + speed[1:]) / 2])
    noise = 0.01 * np.random.default_rng(1).normal(size=800)
    turning = Recording(0.01, speed, (angle + 1.5 * np.sin(3 * angle) + noise)[:, None])
    found = fit(compiled, turning, 100)
    assert found.values()["k"] == pytest.approx(1.1, rel=0.01)
    assert evaluate(found, turning, 100).rms[0] == pytest.approx(0.01, rel=0.1)


def test_a_window_that_is_a_tooth_off_comes_back_though_its_error_is_like_others():
    angle, astray, noise = 0.005 * np.arange(1600.0), [4, 9, 13], np.array([0.1, 0.8])
    drawn = noise * np.random.default_rng(1).normal(size=(1600, 2))
    seen = np.stack([np.cos(8 * angle), angle], axis=1) + drawn
    turning = Recording(0.01, np.full((1600, 1), 0.5), seen)
    compiled = compile_system(compose(parse(TURNING, Model, "turning")))
    problem = Problem(compiled, turning, 100, scale=noise, substeps=4, initial=None)
    problem.initial = angle[::100, None].copy()
    problem.initial[astray] += 2 * np.pi / 8
    found = problem.start_windows(compiled.parameters)
    assert found.initial[:, 0] == pytest.approx(angle[::100], abs=0.05)


def test_a_model_may_call_something_of_its_own_left(recording):
    texts = FOLLOWER, FOLLOWER.replace("w*(", "left*(").replace("parameters.w", "parameters.left")
    placement = Placement("rate_limit", library()["rate_limit"].scaled(sizes(recording)), "drive")
    runs = []
    for text in texts:
        compiled = compile_system(compose(parse(text, Model, "follower"), [placement]))
        runs.append(
            compiled.simulate(
                recording.inputs, DT, np.zeros(1, np.int64), N, initial=np.zeros((1, 2)),
                parameters=compiled.parameters,
            ).outputs
        )  # fmt: skip
    np.testing.assert_array_equal(*runs)


def sizes(recording: Recording) -> dict[str, float]:
    command = recording.inputs[:, 0]
    rate = float(np.sqrt(np.mean(np.gradient(command, DT) ** 2)))
    return {"u": float(command.std()), "rate": rate, "dt": DT}


def test_a_lag_and_a_spring_that_hardens_are_fitted_together_wherever_the_lag_began():
    placements = [
        Placement("lag", library()["lag"].scaled({"u": 1.0, "rate": 1.0, "dt": DT}), "drive"),
        Placement("cubic_stiffness", library()["cubic_stiffness"].scaled({"x": 0.1}), "load"),
    ]
    compiled = compile_system(compose(shipped_models()["mass-spring-damper"], placements))
    t = DT * np.arange(N)
    force = (4 * np.sin(2 * np.pi * 1.2 * t + 1) + 3 * np.sin(2 * np.pi * 2.7 * t))[:, None]
    true = compiled.vector({"drive_lag_tau": 0.02, "load_cubic_stiffness_k3": 2000.0})
    first = np.array([[0.02, 0.1, 3.0]])
    run = compiled.simulate(
        force, DT, np.zeros(1, np.int64), N, initial=first, parameters=true, substeps=8
    )
    noise = 1e-3 * run.outputs[0].std(axis=0)
    measured = run.outputs[0] + noise * np.random.default_rng(2).normal(size=run.outputs[0].shape)
    start = compiled.vector({"drive_lag_tau": 0.015, "load_cubic_stiffness_k3": 100.0})
    found = fit(compiled, Recording(DT, force, measured), HORIZON, start=start, scale=noise)
    assert found.values()["drive_lag_tau"] == pytest.approx(0.02, rel=0.01)
    assert found.values()["load_cubic_stiffness_k3"] == pytest.approx(2000.0, rel=0.05)
    assert (found.rms < 1.1 * noise).all()


@pytest.mark.parametrize("whole", [False, True], ids=["samples", "windows"])
def test_missing_samples_are_no_evidence(whole):
    """Nor are the initial states of windows without a sample: nothing determines them."""
    rng, noise = np.random.default_rng(4), 0.05
    command = rng.normal(size=(4096, 1)).repeat(8, axis=0)[:4096]
    seen = followed(command[:, 0]) + noise * rng.normal(size=4096)
    windows = rng.random(4096 // 32).repeat(32) if whole else rng.random(4096)
    seen[windows < 0.6] = np.nan
    compiled = compile_system(compose(parse(FOLLOWER, Model, "follower")))
    found = fit(compiled, Recording(DT, command, seen[:, None]), 32)
    slopes = found.jacobian.ravel() * found.scale[0]
    assert found.deviations()["w"] == pytest.approx(noise / np.linalg.norm(slopes), rel=0.05)
    left = float(np.sum((found.error * found.scale) ** 2))
    assert left / found.freedom == pytest.approx(noise**2, rel=0.1)


def test_a_gap_at_the_join_of_two_recordings_is_not_bridged():
    """What the last sample of one shows is nothing about the first of the other."""
    seen = np.concatenate([np.full(50, 1.0), np.full(50, 5.0)])
    seen[45:60] = np.nan
    system = compose(parse(FOLLOWER, Model, "follower"))
    found = initial_states(system, Recording(DT, np.zeros((100, 1)), seen[:, None], parts=(50, 50)))
    assert found[:, 0].tolist() == [1.0] * 50 + [5.0] * 50


DERIVED = (Derivative(40.0, 1, 256.0),)
"""How the output of `three_parts` was derived."""


def three_parts() -> Recording:
    return Recording(
        0.15,
        np.arange(60.0).reshape(30, 2),
        np.arange(30.0)[:, None],
        parts=(10, 12, 8),
        driving=1,
        passed=0.2,
        breaks=(4, 15, 22),
        spacings=(0.1, 0.2, 0.1),
        derived=DERIVED,
    )


def test_a_stretch_keeps_the_boundaries_that_it_spans() -> None:
    cut = three_parts().stretch(4, 24)
    assert cut.parts == (6, 12, 2)
    assert cut.spacings == (0.1, 0.2, 0.1)
    assert cut.dt == np.average([0.1, 0.2, 0.1], weights=[6, 12, 2])
    assert cut.breaks == (0, 11, 18)
    assert cut.outputs[:, 0].tolist() == [*range(4, 24)]
    assert cut.inputs[:, 1].tolist() == [*range(9, 49, 2)]
    assert (cut.driving, cut.passed, cut.derived) == (1, 0.2, DERIVED)


def test_each_recording_apart_has_its_own_rate() -> None:
    first, second, third = apart(three_parts())
    assert [one.dt for one in (first, second, third)] == [0.1, 0.2, 0.1]
    assert not any(one.spacings for one in (first, second, third))
    assert [one.breaks for one in (first, second, third)] == [(4,), (5,), (0,)]
    assert second.outputs[:, 0].tolist() == [*range(10, 22)]
    assert second.passed == 0.2

"""A current that jumps with its voltage, in a log with uneven times: no sample between counts."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.physics.engine.equations.model import parse_model
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.data.smeared_steps import beside_steps
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.study import open_study
from tests.workbench.simulated import with_few_effects
from tests.workbench.studies.test_from_logs import written

MOTOR = """
name = "fan"
summary = "A fan on a motor."
hold = "zero"
inputs.voltage = { unit = "V" }
quantities.amps = { expression = "(drive - K*w)/R", unit = "A" }
states.w = { unit = "rad/s", derivative = "(K*amps - b*w)/J", measured = "speed" }
parameters.K = { value = 0.02, unit = "V s/rad", low = 1e-3, high = 0.2 }
parameters.R = { value = 0.3, unit = "ohm", low = 0.01, high = 5.0 }
parameters.J = { value = 1e-4, unit = "kg m^2", low = 1e-6, high = 1e-2 }
parameters.b = { value = 1e-5, unit = "N m s/rad", low = 0.0 }
outputs.speed = { unit = "rad/s", expression = "w" }
outputs.current = { unit = "A", expression = "amps" }
ports.drive = { kind = "actuator", signal = "voltage" }
"""
K, R, J, B = 0.03, 0.2, 2e-4, 2e-4


def log(seed: int, jitter: float = 0.2) -> dict[str, np.ndarray]:
    """Steps of the voltage, and what follows exactly at uneven times, read with noise."""
    draw = np.random.default_rng(seed)
    times = (np.arange(3000) + draw.uniform(-jitter, jitter, 3000)) / 200.0
    voltage = np.repeat(draw.uniform(2.0, 12.0, 30), 100)
    decay, speed, speeds = (K**2 / R + B) / J, 0.0, np.zeros(3000)
    for n, span in enumerate(np.diff(times)):
        final = K * voltage[n] / R / (K**2 / R + B)
        speed = final + (speed - final) * np.exp(-decay * span)
        speeds[n + 1] = speed
    noise = draw.normal(size=(2, 3000))
    current = (voltage - K * speeds) / R
    return {
        "time [s]": times, "voltage [V]": voltage,
        "speed [rad/s]": speeds + 0.2 * noise[0], "current [A]": current + 0.02 * noise[1],
    }  # fmt: skip


def test_a_healthy_machine_is_judged_by_the_samples_between_its_steps(tmp_path: Path) -> None:
    (tmp_path / "fan.toml").write_text(MOTOR)
    paths = [written(tmp_path / f"run{seed}.csv", log(seed)) for seed in (1, 2)]
    words = ["study", "new", tmp_path / "study", "--model", tmp_path / "fan.toml", "--data", *paths]
    assert main([str(word) for word in words]) == 0
    bench = with_few_effects(open_bench(open_study(tmp_path / "study")))
    verdict = ranking(bench)[1]
    assert verdict.word == "nothing_missing"
    assert any("samples of current beside steps" in remark for remark in bench.data.remarks)
    current = bench.base.held_out.residuals[..., 1]
    assert 60 <= np.isnan(current).sum() <= 120
    assert not np.isnan(bench.base.held_out.residuals[:10, :, 0]).any()


@pytest.mark.parametrize("steps", [True, False])
def test_only_steps_of_a_held_input_count(steps: bool) -> None:
    model = parse_model(MOTOR, Path("fan.toml"))
    signal = np.repeat([1.0, 2.0, 1.5], 20) if steps else np.random.default_rng(0).normal(size=60)
    speed, current = beside_steps(model, signal[:, None]).T
    assert not speed.any()
    assert np.flatnonzero(current).tolist() == ([19, 20, 39, 40] if steps else [])

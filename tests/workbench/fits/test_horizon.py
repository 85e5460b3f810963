"""The horizon spans what the model does by itself, is said, kept with an effect, or given."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare.compare import compare
from rigwatch.workbench.compare.horizon import with_horizon
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.steps.change import add, undo
from rigwatch.workbench.steps.study_stages import stages
from rigwatch.workbench.study.study import Study, open_study
from tests.workbench.machine import studied
from tests.workbench.studies.test_own_model import PORT, SPEED, UNITS

SLOW = SPEED.replace("value = 1.0", "value = 0.3") + PORT


def fan(seed: int, samples: int = 6000) -> dict[str, np.ndarray]:
    """A motor that takes seconds to run up, against the drag of the air."""
    generator = np.random.default_rng(seed)
    u = np.repeat(4 * generator.uniform(-1, 1, size=samples // 300), 300)
    v = np.zeros(samples)
    for i in range(1, samples):
        v[i] = v[i - 1]
        for _ in range(2):
            drag = 0.05 * abs(v[i]) * v[i]
            v[i] += 0.005 * (-0.25 * v[i] + 0.6 * u[i - 1] - drag)
    return {"u": u, "v": v + 0.08 * generator.normal(size=samples)}


def studied_with(folder: Path, keys: str = "") -> Study:
    return studied(folder, SLOW, [fan(0)], [fan(1)], UNITS, keys)


def test_it_spans_the_models_time_constants_and_the_right_effect_is_named(tmp_path: Path) -> None:
    found = explain(studied_with(tmp_path))
    assert (found.verdict, found.ranking[0].effect) == ("missing_effect", "quadratic_drag")
    (said,) = [remark for remark in found.comparison.remarks if "horizon" in remark]
    assert "horizon 6 s, chosen from the model's time constant of 2.4 s" in said


def test_it_stays_with_the_first_effect_and_goes_with_it(tmp_path: Path) -> None:
    study = studied_with(tmp_path)
    change = add(study, "quadratic_drag")
    assert "horizon = 6.0" in (study.folder / "study.toml").read_text()
    again = compare(open_study(study.folder))
    assert again.held_out_error == pytest.approx(change.after.held_out_error, rel=1e-6)
    undo(open_study(study.folder))
    assert "horizon" not in (study.folder / "study.toml").read_text()


def test_what_is_given_is_taken(tmp_path: Path) -> None:
    found = compare(studied_with(tmp_path, "horizon = 0.5"))
    assert not any("horizon" in remark for remark in found.remarks)


LIGHT = """
name = "lightly damped"
summary = "A mass on a spring that rings for many periods."
inputs.u = { unit = "m/s^2", hold = "zero" }
states.x = { unit = "m", derivative = "v", measured = "x" }
states.v = { unit = "m/s", derivative = "u - c*v - k*x + load", rate_of = "x" }
parameters.c = { value = 0.7, unit = "1/s" }
parameters.k = { value = 900.0, unit = "1/s^2" }
outputs.x = { unit = "m", expression = "x" }
[ports.load]
kind = "force"
unit = "m/s^2"
variables.x = { expression = "x", unit = "m" }
"""


def ringing(seed: int, damping: float, samples: int = 4000) -> dict[str, np.ndarray]:
    """An oscillator of 30 rad/s, driven by noise and read a hundred times a second."""
    generator = np.random.default_rng(seed)
    u, x, v = generator.normal(size=samples), np.zeros(samples), 0.0
    for i in range(1, samples):
        x[i] = x[i - 1]
        for _ in range(20):
            v += 0.0005 * (u[i - 1] - damping * v - 900 * x[i])
            x[i] += 0.0005 * v
    return {"u": u, "x": x}


@pytest.mark.parametrize(
    ("damping", "periods"),
    [
        pytest.param(20.0, 2.0, id="two periods, if the oscillation decays sooner"),
        pytest.param(3.0, 9.5, id="three time constants of the decay"),
        pytest.param(0.6, 12.0, id="a dozen periods, if it rings for longer"),
    ],
)
def test_an_oscillation_is_followed_until_it_has_decayed(
    tmp_path: Path, damping: float, periods: float
) -> None:
    tables = [ringing(seed, damping) for seed in (0, 1)]
    study = studied(tmp_path, LIGHT, tables[:1], tables[1:], {"u": "m/s^2", "x": "m"})
    chosen = with_horizon(study)
    assert chosen.file.horizon == pytest.approx(periods * 2 * np.pi / 30, rel=0.06)
    assert "that decays in" in chosen.horizon_from


def test_two_periods_are_spanned_though_the_recording_holds_few(tmp_path: Path) -> None:
    # Seventeen periods of 0.21 s: a tenth of them would be 1.7.
    tables = [ringing(seed, 0.6, 356) for seed in (0, 1)]
    study = studied(tmp_path, LIGHT, tables[:1], tables[1:], {"u": "m/s^2", "x": "m"})
    chosen = with_horizon(study)
    assert chosen.file.horizon == pytest.approx(2 * 2 * np.pi / 30, rel=0.06)
    assert "limited to two periods" in chosen.horizon_from


@pytest.mark.parametrize("samples", [1563, 2868])
def test_recordings_that_fill_no_number_of_horizons_do_not_end_it(
    tmp_path: Path, samples: int
) -> None:
    parts = [{name: column[:samples] for name, column in fan(seed).items()} for seed in (0, 2)]
    study = studied(tmp_path, SLOW, parts, [fan(1)], UNITS)
    assert "time constant" in with_horizon(study).horizon_from


BLOCK = """
name = "block"
summary = "A block that a heater warms."
inputs.u = { unit = "%", hold = "zero" }
states.T = { unit = "K", derivative = "(k*heater - T)/tau", measured = "T" }
parameters.k = { value = 50.0, unit = "K", low = 0.0 }
parameters.tau = { value = 100.0, unit = "s", low = 5.0 }
outputs.T = { unit = "K", expression = "T" }
[ports.heater]
kind = "actuator"
signal = "u"
[ports.probe]
kind = "sensor"
signal = "T"
"""


def heated(seed: int, samples: int = 200) -> dict[str, np.ndarray]:
    """A block whose heater steps once a minute, read every 3 s by a probe of 20 s."""
    generator = np.random.default_rng(seed)
    u = np.repeat(generator.uniform(0, 100, size=samples // 20), 20)
    block, probe, read = 0.0, 0.0, np.zeros(samples)
    for i in range(1, samples):
        for _ in range(30):
            block += 0.1 * (0.6 * u[i - 1] - block) / 170
            probe += 0.1 * (block - probe) / 20
        read[i] = probe
    return {"u": u, "T": read + 0.03 * generator.normal(size=samples)}


def test_a_drive_that_steps_at_equal_times_steps_inside_the_windows(tmp_path: Path) -> None:
    tables, units = [heated(0, 400), heated(1)], {"u": "%", "T": "K"}
    study = studied(tmp_path, BLOCK, tables[:1], tables[1:], units, rates=[1 / 3] * 2)
    assert "shortened as inputs would only change" in with_horizon(study).horizon_from
    found = explain(study)
    assert found.verdict == "missing_effect"
    late = {f"{name}@{port}" for name in ("lag", "delay") for port in ("heater", "probe")}
    assert f"{found.ranking[0].effect}@{found.ranking[0].port}" in late


def test_a_log_shorter_than_the_usual_horizon_can_be_studied(tmp_path: Path) -> None:
    samples = {name: column[200:350] for name, column in fan(0, 900).items()}
    study = studied(tmp_path, SLOW, [samples], [samples], UNITS, rates=[1000.0] * 2)
    assert with_horizon(study).file.horizon < 0.15


CASCADE = """
name = "cascade"
summary = "Two tanks, one above the other; only the lower level is measured."
inputs.pump = { unit = "V", hold = "zero" }
states.x1 = { unit = "V", derivative = "kp*drive - k1*x1*sqrt(1/(abs(x1) + xt)) + upper" }
[states.x2]
unit = "V"
derivative = "k1*x1*sqrt(1/(abs(x1) + xt)) - k2*x2*sqrt(1/(abs(x2) + xt))"
measured = "level"
[parameters]
xt = { value = 0.01, unit = "V", fixed = true }
k1 = { value = 0.05, unit = "V^(1/2)/s", low = 0.0 }
k2 = { value = 0.05, unit = "V^(1/2)/s", low = 0.0 }
kp = { value = 0.05, unit = "1/s", low = 0.0 }
[outputs.level]
unit = "V"
expression = "x2"
[ports.drive]
kind = "actuator"
signal = "pump"
[ports.upper]
kind = "force"
unit = "V/s"
variables.p = { expression = "x1", unit = "V" }
"""


def cascade(seed: int, samples: int = 320) -> dict[str, np.ndarray]:
    """Two tanks; the upper one spills over, half of it into the lower one; read every 4 s."""
    generator = np.random.default_rng(seed)
    time, u = 4.0 * np.arange(samples), np.full(samples, 3.0)
    for frequency in generator.uniform(1 / 900, 1 / 120, size=8):
        size, phase = generator.uniform(0.3, 1.0), generator.uniform(0, 2 * np.pi)
        u += size * np.sin(2 * np.pi * frequency * time + phase)
    u, upper, lower, level = np.clip(u, 0.5, 7.0), 6.0, 5.0, np.zeros(samples)
    for i in range(samples):
        level[i] = min(lower, 10.0)
        for _ in range(40):
            falls, leaves = 0.055 * np.sqrt(upper), 0.06 * np.sqrt(lower)
            spilt = 2.0 * max(upper - 9.0, 0.0)
            upper += 0.1 * (0.05 * u[i] - falls - spilt)
            lower += 0.1 * (falls - leaves + 0.5 * spilt)
    return {"pump": u, "level": level + 0.015 * generator.normal(size=samples)}


@pytest.mark.parametrize("seed", [0, 2])
def test_hidden_states_that_continue_leave_a_fit_over_short_windows_an_optimum(
    tmp_path: Path, seed: int
) -> None:
    tables = [cascade(seed), cascade(seed + 100)]
    units = {"pump": "V", "level": "V"}
    study = studied(tmp_path, CASCADE, tables[:1], tables[1:], units, rates=[0.25] * 2)
    found = compare(study)
    assert found.convergence is not None
    assert found.convergence.converged
    (said,) = [remark for remark in found.remarks if "horizon" in remark]
    assert "limited to a tenth of the shortest recording;" in said
    (alone,) = stages(study)
    assert alone.comparison.held_out_error == found.held_out_error

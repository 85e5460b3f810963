"""Two sensors of one make that lag alike: the effect is offered at both, beside other physics."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from rigwatch.workbench.compare import Bench, open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.sets.like_ports import like_ports, with_like_ports
from rigwatch.workbench.explain.sets.set_gain import set_gain
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking import no_progress, rank_all
from rigwatch.workbench.steps.change import add
from rigwatch.workbench.study.study import Study, open_study
from tests.workbench.machine import studied
from tests.workbench.simulated import knowing

MODEL = """\
name = "two-heaters"
summary = "Two heated bodies side by side, each with a temperature sensor."
hold = "zero"

[inputs.q1]
unit = "W"

[inputs.q2]
unit = "W"

[states.Th1]
unit = "K"
derivative = "(P1*heater1 - G*(Th1 - Ta) - B*(Th1 - Th2) + loss1)/C"
measured = "t1"
start = 294.0

[states.Th2]
unit = "K"
derivative = "(P2*heater2 - G*(Th2 - Ta) - B*(Th2 - Th1) + loss2)/C"
measured = "t2"
start = 294.0

[parameters]
P1 = { value = 0.8, unit = "1", low = 0.0 }
P2 = { value = 0.8, unit = "1", low = 0.0 }
C = { value = 4.0, unit = "J/K", fixed = true, low = 0.1 }
G = { value = 0.03, unit = "W/K", low = 0.0 }
B = { value = 0.02, unit = "W/K", low = 0.0 }
Ta = { value = 294.0, unit = "K", fixed = true, low = 250.0 }

[outputs.t1]
unit = "K"
expression = "Th1"

[outputs.t2]
unit = "K"
expression = "Th2"

[ports.heater1]
kind = "actuator"
signal = "q1"

[ports.heater2]
kind = "actuator"
signal = "q2"

[ports.loss1]
kind = "force"
unit = "W"
variables.T = { expression = "Th1", unit = "K" }
variables.Ta = { expression = "Ta", unit = "K" }

[ports.loss2]
kind = "force"
unit = "W"
variables.T = { expression = "Th2", unit = "K" }
variables.Ta = { expression = "Ta", unit = "K" }

[ports.sensor1]
kind = "sensor"
signal = "t1"

[ports.sensor2]
kind = "sensor"
signal = "t2"
"""
UNITS = {"q1": "W", "q2": "W", "t1": "K", "t2": "K"}
STEP = 4.0
SAMPLES = 250
# Each heater is switched a few times, one after the other, as in a lesson on step responses.
STEPS = (0, 5, 25, 75, 125, 150, 175, 225)
LOG = ((0, 0), (2.4, 0), (2.4, 1), (0.6, 2.85), (0.6, 0.75), (2.1, 0.75), (2.1, 3.0), (1.5, 3.0))


def two_bodies(
    lags: tuple[float, float], draught: float = 0.0, seed: int = 11
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Both halves of a log of two bodies in air, in Celsius, in small steps of Euler's method.

    The air takes heat with the power 1.25 of the difference, which the model has linear, and beads
    of glass lag behind the bodies by `lags` [s]. A `draught` [W] of a minute's gusts cools both.
    """
    rng = np.random.default_rng(seed)
    powers = np.repeat(np.array(LOG), np.diff([*STEPS, SAMPLES]), axis=0)
    body, bead, lagging = np.full(2, 20.85), np.full(2, 20.85), np.array(lags)
    rows, steps, gust = [], 40, np.zeros(2)
    for power in powers:
        gust = 0.94 * gust + 0.34 * draught * rng.standard_normal(2)
        rows.append(bead.copy())
        for _ in range(steps):
            above = body - 20.85
            lost = 0.015 * np.sign(above) * np.abs(above) ** 1.25
            across = 0.02 * (body - body[::-1])
            body = body + STEP / steps * (power - lost - across - gust) / 4.0
            bead = bead + STEP / steps * (body - bead) / lagging
    read = np.array(rows) + 273.15 + 0.1 * rng.standard_normal((SAMPLES, 2))
    table = {"q1": powers[:, 0], "q2": powers[:, 1], "t1": read[:, 0], "t2": read[:, 1]}
    half = SAMPLES * 3 // 5
    return {k: v[:half] for k, v in table.items()}, {k: v[half:] for k, v in table.items()}


def recorded(folder: Path, lags: tuple[float, float], model: str = MODEL) -> Study:
    train, held_out = two_bodies(lags)
    return studied(folder, model, [train], [held_out], UNITS, rates=[1 / STEP] * 2)


def judged(study: Study) -> Verdict:
    """The verdict where the library knows no law of the air: something is left."""
    return ranking(open_bench(knowing(study, "lag", "offset")))[1]


def test_the_command_that_is_offered_adds_the_effect_at_both_sensors(tmp_path: Path) -> None:
    folder = recorded(tmp_path, (20.0, 20.0)).folder
    found = judged(open_study(folder))
    assert found.word == "unknown_effect"
    assert "lag at sensor1 and sensor2 alike takes the held-out error from " in found.text
    assert found.text.endswith(f"rigwatch add {folder} lag --port sensor1 --with lag@sensor2")
    first = add(open_study(folder), "lag", "sensor1", beside=("lag@sensor2",))
    then = add(open_study(folder), "lag", "sensor2")
    assert (first.step, then.step) == ("add", "add")
    assert then.after.held_out_error < 0.5 * first.before.held_out_error


def in_gusts(folder: Path, seed: int) -> Bench:
    """A short log in a draught: heater 1 is switched on once, heater 2 once."""
    train, held_out = (
        {name: column[part] for name, column in two_bodies((20.0, 20.0), 0.5, seed)[0].items()}
        for part in (slice(40), slice(40, None))
    )
    study = studied(folder, MODEL, [train], [held_out], UNITS, rates=[1 / STEP] * 2)
    return open_bench(knowing(study, "lag", "offset"))


def test_where_the_training_determines_none_by_itself_one_parameter_is_asked_for(
    tmp_path: Path,
) -> None:
    bench = in_gusts(tmp_path, 10)
    assert set_gain(bench, "lag@sensor1", ("lag@sensor2",)).vague
    rows = rank_all(bench.study, bench.data, bench.base)
    # Its score is within chance here; it is tried where that is not so.
    next(row for row in rows if row.label == "lag@sensor1").p_value = 0.01
    unnamed = Verdict("unknown_effect", None, (), (), "no effect")
    found = with_like_ports(bench, rows, unnamed, no_progress)
    assert found.word == "unknown_effect"
    assert "the training determines none by itself" in found.text
    assert "one parameter for all of them" in found.text
    named = replace(unnamed, word="missing_effect")
    assert with_like_ports(bench, rows, named, no_progress) is named


def test_an_error_that_falls_by_chance_is_no_undetermined_strength(tmp_path: Path) -> None:
    gain = set_gain(in_gusts(tmp_path, 9), "lag@sensor1", ("lag@sensor2",))
    assert "no more than by chance" in gain.reason
    assert not gain.vague


def test_a_sensor_that_lags_alone_offers_nothing_at_the_other(tmp_path: Path) -> None:
    assert " alike takes " not in judged(recorded(tmp_path, (20.0, 0.2))).text


def test_ports_are_alike_by_kind_unit_and_variables(tmp_path: Path) -> None:
    other = MODEL.replace('variables.T = { expression = "Th2", unit = "K" }\n', "")
    pairs = {("heater1", "heater2"), ("loss1", "loss2"), ("sensor1", "sensor2")}
    assert set(like_ports(recorded(tmp_path / "a", (20.0, 20.0)).model)) == pairs
    found = like_ports(recorded(tmp_path / "b", (20.0, 20.0), other).model)
    assert set(found) == pairs - {("loss1", "loss2")}

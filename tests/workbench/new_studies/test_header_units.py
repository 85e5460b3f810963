"""A unit that is not understood is asked for; a speed is never taken in another unit."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.physics.engine.equations.model import Model, shipped_models
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files.loading import parse
from rigwatch.workbench.data.signals import prepare
from rigwatch.workbench.steps.log_columns import matched
from rigwatch.workbench.study.ledger import append
from rigwatch.workbench.study.study import open_study
from rigwatch.workbench.study.told_units import told_unit
from sim_plant.machines import MACHINES, log

MOTOR = ["--model", "motor", "--set", "R=2.0", "--set", "K=0.06"]
RPM = 30 / np.pi


@pytest.fixture(scope="module")
def run() -> dict[str, np.ndarray]:
    return log(MACHINES["motor"], {}, 0.003, seed=1)


def made(folder: Path, run: dict[str, np.ndarray], header: str, *more: str) -> int:
    """A study of the motor's log, with the speed in turns a minute under the given header."""
    time, voltage, speed = run.values()
    rows = zip(time, voltage, RPM * speed, strict=True)
    lines = [f"time_s,voltage_V,{header}", *(",".join(f"{v:.12g}" for v in row) for row in rows)]
    path = folder / "run.csv"
    path.write_text("\n".join(lines) + "\n")
    return main(["study", "new", str(folder / "study"), "--data", str(path), *MOTOR, *more])


def speed(folder: Path) -> np.ndarray:
    return prepare(open_study(folder / "study")).train.outputs[:100, 0]


@pytest.mark.parametrize(
    "header", ["Speed [U/min]", "Speed [RPM]", "Speed [rpm] filtered", "Speed [rpm] (avg)"]
)
def test_usual_spellings_of_a_unit_are_read(tmp_path, run, header):
    assert made(tmp_path, run, header) == 0
    np.testing.assert_allclose(speed(tmp_path), run["speed_rad_s"][:100], rtol=1e-9, atol=1e-9)
    study = open_study(tmp_path / "study")
    assert told_unit(study.model.outputs["speed"]) == "rpm"
    path = tmp_path / "study" / "study.toml"
    path.write_text(path.read_text().replace('"rpm"', '"V"'))
    with pytest.raises(ModelError, match=r"shown\.speed: .*'V'"):
        open_study(tmp_path / "study")


def test_the_steps_of_a_study_are_told_in_the_unit_of_its_log(tmp_path, run, capsys):
    assert made(tmp_path, run, "Speed [rpm]") == 0
    study = open_study(tmp_path / "study")
    step = {"train_error": 0.1 * np.pi, "held_out_error": 0.2 * np.pi, "unit": "rad/s"}
    append(study, "add", effect="coulomb", port="shaft", **step)
    assert main(["study", "show", str(study.folder)]) == 0
    shown = capsys.readouterr().out.splitlines()[-1]
    assert shown.split()[-4:] == ["coulomb@shaft", "3", "6", "rpm"]


def test_a_temperature_without_a_unit_may_be_in_degrees_celsius():
    columns = ["time", "power", "ambient", "temperature"]
    found = matched(columns, shipped_models()["heated-block"], {})
    said = "temperature: no unit in its header, assumed K; for degrees Celsius give"
    assert f"{said} --map 'temperature=temperature[degC]'" in found.remarks
    assert "power: no unit in its header, assumed W" in found.remarks


def test_a_unit_that_is_not_known_is_asked_for(tmp_path, run, capsys):
    assert made(tmp_path, run, "Speed [turns/min]") == 2
    said = capsys.readouterr().err
    assert "Speed [turns/min]: found 'turns/min' in the header's brackets" in said
    assert "--map 'speed=Speed [turns/min][UNIT]' with a known one" in said
    assert "or --map 'speed=Speed [turns/min] * FACTOR [rad/s]'" in said
    for number, given in enumerate(("[rpm]", " * 0.10471975512 [rad/s]")):
        folder = tmp_path / str(number)
        folder.mkdir()
        option = f"speed=Speed [turns/min]{given}"
        assert made(folder, run, "Speed [turns/min]", "--map", option) == 0
        np.testing.assert_allclose(speed(folder), run["speed_rad_s"][:100], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("header", "more"),
    [
        pytest.param("Speed [1/min]", (), id="of the header"),
        pytest.param("Speed [min-1]", (), id="with a negative power"),
        pytest.param("n", ("--map", "speed=n[1/min]"), id="of the option"),
        pytest.param("n [1/min]", ("--map", "speed=n [1/min]"), id="of a header that is named"),
        pytest.param("n [1/min]", ("--map", "speed=n[1/min]"), id="named without its blank"),
    ],
)
def test_turns_a_minute_are_no_angles_a_minute(tmp_path, run, capsys, header, more):
    assert made(tmp_path, run, header, *more) == 0
    assert "is read as rpm" in capsys.readouterr().err
    np.testing.assert_allclose(speed(tmp_path), run["speed_rad_s"][:100], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("unit", ["1/s", "Hz"])
def test_a_rate_that_may_count_turns_or_angles_is_asked_for(tmp_path, run, capsys, unit):
    assert made(tmp_path, run, f"Speed [{unit}]") == 2
    said = capsys.readouterr().err
    assert f"found the unit {unit} for speed [rad/s], which may count turns or angles" in said
    assert made(tmp_path, run, "n", "--map", f"speed=n[{unit}]") == 2
    assert "expected a unit of 'rad/s'" in capsys.readouterr().err


def test_a_time_in_something_that_is_no_unit_is_asked_for(tmp_path, run, capsys):
    path = tmp_path / "run.csv"
    rows = zip(*run.values(), strict=True)
    lines = ["time [ticks],voltage_V,speed_rad_s", *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines))
    new = ["study", "new", str(tmp_path / "study"), "--data", str(path), *MOTOR]
    assert main(new) == 2
    assert "expected --time 'time [ticks][s]'" in capsys.readouterr().err
    assert main([*new, "--time", "time [ticks][s]"]) == 0


BLOCK = shipped_models()["heated-block"]


def test_a_column_that_no_name_takes_is_told_by_its_unit():
    columns = ["time [s]", "Air [degC]", "Power [W]", "Block temperature [degC]"]
    found = matched(columns, BLOCK, {}).channels
    own = {"power": "Power [W]", "temperature": "Block temperature [degC]", "ambient": "Air [degC]"}
    assert {name: column.rsplit("[", 1)[0] for name, column in found.items()} == own


def test_of_two_columns_that_suit_the_options_are_told_with_their_own_units():
    columns = ["time [s]", "Air [degC]", "Base [degF]", "Power [W]", "Block temperature [degC]"]
    with pytest.raises(ModelError, match=r"--map 'ambient=Air \[degC\]' or --map 'ambient=Base"):
        matched(columns, BLOCK, {})


BEAM = parse(
    """
name = "beam"
summary = "A beam on a shaker."
inputs.force = { unit = "N" }
parameters.m = { value = 1.0, unit = "kg" }
parameters.k = { value = 100.0, unit = "N/m" }
states.x = { unit = "m", derivative = "v", start = 0.0 }
states.v = { unit = "m/s", derivative = "(force - k*x)/m" }
outputs.drive_point = { unit = "m/s^2", expression = "(force - k*x)/m" }
outputs.tip_point = { unit = "m/s^2", expression = "2*(force - k*x)/m" }
""",
    Model,
    "beam.toml",
)
BEAM_LOG = ["Time (s)", "force_N", "acc drive [m/s^2]", "acc tip [g]"]


@pytest.mark.parametrize("given", [{}, {"tip_point": "acc tip [g]"}])
def test_an_accelerometers_g_is_standard_gravity(given):
    found = matched(BEAM_LOG, BEAM, given)

    assert found.channels["tip_point"] == "acc tip [g][g0]"
    assert found.channels["drive_point"] == "acc drive [m/s^2][m/s^2]"
    assert "acc tip [g]: g is read as standard gravity (g0)" in found.remarks


def test_a_g_of_a_mass_is_a_gram():
    scale = parse(
        """
name = "scale"
summary = "A tank on a scale."
inputs.inflow = { unit = "kg/s" }
parameters.k = { value = 1.0, unit = "1" }
states.mass = { unit = "kg", derivative = "k*inflow", measured = "weight" }
outputs.weight = { unit = "kg", expression = "mass" }
""",
        Model,
        "scale.toml",
    )
    found = matched(["t [s]", "inflow [g/s]", "weight_g"], scale, {}).channels

    assert found == {"inflow": "inflow [g/s][g/s]", "weight": "weight_g[g]"}


def test_c_beside_a_temperature_is_degrees():
    found = matched(["time [s]", "ambient_C", "Power [W]", "temperature_C"], BLOCK, {})

    assert found.channels["ambient"] == "ambient_C[degC]"
    assert found.channels["temperature"] == "temperature_C[degC]"
    assert "ambient_C: C is read as degC" in found.remarks


def test_a_header_of_another_quantity_is_refused():
    with pytest.raises(ModelError, match=r"force_N: found the unit N in the header for tip_point"):
        matched(BEAM_LOG, BEAM, {"tip_point": "force_N"})


def test_all_signals_without_a_column_are_told_at_once():
    with pytest.raises(ModelError) as error:
        matched(["time [s]", "Power [W]", "one [bar]", "other [bar]"], BLOCK, {})

    assert "for ambient [K] and temperature [K] among" in str(error.value)
    assert str(error.value).endswith("--map 'ambient=COLUMN[K]' --map 'temperature=COLUMN[K]'")


def test_a_column_of_another_signal_is_not_offered():
    columns = ["Time (s)", "force_N", "drive_point [m/s^2]", "tip [mm]"]
    with pytest.raises(ModelError, match=r"--map 'tip_point=COLUMN\[m/s\^2\]'$"):
        matched(columns, BEAM, {})


CART = parse(
    """
name = "cart"
summary = "A cart in the wind."
inputs.wind = { unit = "m/s" }
parameters.m = { value = 1.0, unit = "kg" }
parameters.c = { value = 1.0, unit = "kg/s" }
states.v = { unit = "m/s", derivative = "-c*(v + wind)/m", measured = "speed" }
outputs.speed = { unit = "m/s", expression = "v" }
""",
    Model,
    "cart.toml",
)


@pytest.mark.parametrize(
    ("wind", "speed_header"),
    [("headwind [m/s]", "car [km/h]"), ("Gegenwind [m/s]", "Geschwindigkeit [km/h]")],
)
def test_a_compound_counts_as_what_it_is_a_kind_of(wind, speed_header):
    found = matched(["time [s]", speed_header, wind], CART, {}).channels
    names = {name: column.rsplit("[", 1)[0] for name, column in found.items()}
    assert names == {"wind": wind, "speed": speed_header}

"""What column headers of loggers tell, and logs as loggers in other countries write them."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.exchange.mapping import ImportMapping
from rigwatch.wire.exchange.table_files import read_table
from rigwatch.wire.texts import read_header
from rigwatch.wire.units import unit_of


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("speed_rad_s", "speed", "rad/s"),
        ("Speed [rpm]", "speed", "rpm"),
        ("Motor Voltage (V)", "motor_voltage", "V"),
        ("acceleration_m_s2", "acceleration", "m/s^2"),
        ("force_kN", "force", "kN"),
        ("flow l/min", "flow", "l/min"),
        ("level1_m", "level1", "m"),
        ("time_ms", "time", "ms"),
        ("Speed [RPM]", "speed", "rpm"),
        ("Speed [U/min]", "speed", "rpm"),
        ("Speed [r/min]", "speed", "rpm"),
        ("Speed_RPM", "speed", "rpm"),
        ("Speed [min-1]", "speed", "min^-1"),
        ("Speed [rpm] filtered", "speed_filtered", "rpm"),
        ("Speed [rpm] (avg)", "speed", "rpm"),
        ("Speed (avg) [rpm]", "speed", "rpm"),
        ("speed_rpm (filtered)", "speed", "rpm"),
        ("rate (rad/sec)", "rate", "rad/s"),
        ("Pos [mm] filtered", "pos_filtered", "mm"),
        ("u [Volt]", "u", "V"),
        ("t [sec]", "t", "s"),
        ("torque [N-m]", "torque", "N m"),
        ("drag [N/(m/s)]", "drag", "N/(m/s)"),
        ("pressure [mBar]", "pressure", "mbar"),
        ("airway [cmH2O]", "airway", "cmWC"),
        ("static (in.WG)", "static", "inWC"),
        ("share [-]", "share", "1"),
    ],
)
def test_a_header_tells_name_and_unit(header, name, unit):
    found = read_header(header)
    assert found.name == name
    assert unit_of(found.units[0]) == unit_of(unit)


@pytest.mark.parametrize("header", ["omega", "t", "channel 3", "speed [furlongs]"])
def test_a_header_without_a_unit_tells_none(header):
    assert read_header(header).units == ()


@pytest.mark.parametrize("text", ["furlongs", "mw", "NM", "m?"])
def test_what_stands_in_brackets_and_is_no_unit_is_kept_to_be_told(text):
    found = read_header(f"speed [{text}]")
    assert (found.units, found.unknown) == ((), text)


def test_a_torque_and_a_stiffness_are_both_meant_until_the_model_says():
    assert read_header("torque_N_m").units == ("N/m", "N m")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("t;u\n0,0;1,5\n0,1;-2,25\n", id="decimal comma"),
        pytest.param("t\tu\n0.0\t1.5\n0.1\t-2.25\n", id="tabs"),
        pytest.param("t,u\n0.0,1.5\n0.1,-2.25\n", id="commas"),
    ],
)
def test_numbers_are_the_same_however_a_country_writes_them(tmp_path: Path, text: str):
    path = tmp_path / "log.csv"
    path.write_text(text)
    table = read_table(path, ImportMapping())
    np.testing.assert_array_equal(table.numbers("u"), [1.5, -2.25])


def test_a_decimal_comma_is_found_however_late_it_comes(tmp_path: Path):
    path = tmp_path / "log.csv"
    path.write_text("t;u\n" + "".join(f"{row};0\n" for row in range(300)) + "300;1,5\n")
    assert read_table(path, ImportMapping()).numbers("u")[-1] == 1.5


def test_a_log_without_header_asks_for_names(tmp_path: Path):
    path = tmp_path / "log.csv"
    path.write_text("0.0,1.5\n0.1,2\n")
    with pytest.raises(ImportDataError, match=r"log\.csv:1: found numbers.*--columns"):
        read_table(path, ImportMapping())
    table = read_table(path, ImportMapping(columns=("t", "u")))
    np.testing.assert_array_equal(table.numbers("u"), [1.5, 2.0])

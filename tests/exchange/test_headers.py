"""Headers of columns as loggers write them: quantity and unit, or a number that counts."""

import pytest

from rigwatch.wire.texts import read_header


@pytest.mark.parametrize(
    ("column", "name", "units"),
    [
        ("h_1", "h_1", ()),
        ("Heater 1", "heater_1", ()),
        ("Temperature 1 (degC)", "temperature_1", ("degC",)),
        ("Time (sec)", "time", ("s",)),
        ("time [Seconds]", "time", ("s",)),
        ("time_millis", "time", ("ms",)),
        ("Temp [Celsius]", "temp", ("degC",)),
        ("duty percent", "duty", ("%",)),
        ("accel_m_s2", "accel", ("m/s2", "m s2")),
    ],
)
def test_a_header_is_read(column: str, name: str, units: tuple[str, ...]) -> None:
    found = read_header(column)
    assert (found.name, found.units) == (name, units)

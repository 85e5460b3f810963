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
        ("gain_per_deg", "gain", ("1/deg",)),
        ("stiffness_N_per_mm", "stiffness", ("N/mm",)),
        ("drag_N_per_mm_s", "drag", ("N/(mm s)",)),
        ("slope_V_Per_m_per_s", "slope", ("V/m/s",)),
        ("tag_per_unit_42", "tag_per_unit_42", ()),
        ("millis", "millis", ("ms",)),
        ("Micros", "micros", ("us",)),
        ("T", "t", ()),
        ("min", "min", ()),
    ],
)
def test_a_header_is_read(column: str, name: str, units: tuple[str, ...]) -> None:
    found = read_header(column)
    assert (found.name, found.units) == (name, units)

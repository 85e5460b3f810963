"""Units: one table, exact factors, numbers in SI from where they are read, plain errors."""

import math

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect import Effect, EffectParameter
from rigwatch.physics.engine.equations.effect_files import EffectFile
from rigwatch.physics.engine.equations.model import Model, Parameter, State
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.windowed_fit import fit
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.wire.typed_files.loading import parse
from rigwatch.wire.units import NONE, UnitError, describe, simplified, unit_of
from rigwatch.wire.units.unit_table import ENTRIES

MOTOR = """
name = "motor"
summary = "A DC motor without inductance, speed from voltage."
inputs.u = { unit = "V" }
parameters.kt = { value = 0.05, unit = "N m/A" }
parameters.R = { value = 1.2, unit = "ohm" }
parameters.J = { value = 1e-4, unit = "kg m^2" }
parameters.d = { value = 1e-5, unit = "N m s" }
outputs.speed = { unit = "rad/s", expression = "w" }

[states.w]
unit = "rad/s"
derivative = "(kt*u/R - (d + kt**2/R)*w)/J"
"""
SPRING = """
name = "spring"
summary = "A force that grows with position."
inputs.position = { unit = "m" }
outputs.force = { unit = "N", expression = "k*position + load" }

[parameters.k]
value = 2.0
unit = "kN/mm"

[ports.load]
kind = "force"
unit = "kN"
variables.x = { expression = "position", unit = "mm" }
"""
STOP = """
[effects.stop]
port = "force"
expression = "k*max(abs(x) - gap, 0)*sign(x)"
physics = "A stop behind a gap."
source = "here"
parameters.k = { unit = "{F}/{x}", value = 3.0, low = 0.0, role = "strength" }
parameters.gap = { unit = "mm", value = 0.5, low = 0.1, high = 2.0, tried = [0.2, 0.4] }
"""


@pytest.mark.parametrize(
    ("text", "factor", "si", "dimension"),
    [
        ("mm", 1e-3, "m", "m"),
        ("um", 1e-6, "m", "m"),
        ("inch", 0.0254, "m", "m"),
        ("ms", 1e-3, "s", "s"),
        ("us", 1e-6, "s", "s"),
        ("rpm", math.pi / 30, "rad/s", "s^-1"),
        ("deg", math.pi / 180, "rad", "1"),
        ("%", 0.01, "1", "1"),
        ("g", 1e-3, "kg", "kg"),
        ("g0", 9.80665, "m/s^2", "m s^-2"),
        ("gn", 9.80665, "m/s^2", "m s^-2"),
        ("lbf", 4.4482216152605, "N", "kg m s^-2"),
        ("gf", 9.80665e-3, "N", "kg m s^-2"),
        ("kip", 4448.2216152605, "N", "kg m s^-2"),
        ("psi", 6894.757293168362, "Pa", "kg m^-1 s^-2"),
        ("bar", 1e5, "Pa", "kg m^-1 s^-2"),
        ("kPa", 1e3, "Pa", "kg m^-1 s^-2"),
        ("MPa", 1e6, "Pa", "kg m^-1 s^-2"),
        ("N/mm^2", 1e6, "N/m^2", "kg m^-1 s^-2"),
        ("kN/m", 1e3, "N/m", "kg s^-2"),
        ("kip/inch", 4448.2216152605 / 0.0254, "N/m", "kg s^-2"),
        ("l/min", 1e-3 / 60, "m^3/s", "m^3 s^-1"),
        ("mV", 1e-3, "V", "kg m^2 s^-3 A^-1"),
        ("kV", 1e3, "V", "kg m^2 s^-3 A^-1"),
        ("mA", 1e-3, "A", "A"),
        ("kohm", 1e3, "ohm", "kg m^2 s^-3 A^-2"),
        ("mH", 1e-3, "H", "kg m^2 s^-2 A^-2"),
        ("uF", 1e-6, "F", "kg^-1 m^-2 s^4 A^2"),
        ("Wb", 1.0, "Wb", "kg m^2 s^-2 A^-1"),
        ("kW", 1e3, "W", "kg m^2 s^-3"),
        ("W/degC", 1.0, "W/K", "kg m^2 s^-3 K^-1"),
        ("(mm/s)^2", 1e-6, "(m/s)^2", "m^2 s^-2"),
        ("m/s2", 1.0, "m/s^2", "m s^-2"),
        ("mm³", 1e-9, "m^3", "m^3"),
        ("l/(min bar^0.5)", 1e-3 / 60 / math.sqrt(1e5), "m^3/(s Pa^0.5)", "kg^(-1/2) m^(7/2)"),
        ("mm^(5/2)/s", 1e-3**2.5, "m^2.5/s", "m^(5/2) s^-1"),
        ("(mm)^(-1/2)", 1e-3**-0.5, "(m)^-0.5", "m^(-1/2)"),
    ],
)
def test_a_unit_has_its_factor_and_its_dimension(
    text: str, factor: float, si: str, dimension: str
) -> None:
    found = unit_of(text)
    assert float(found.factor) == pytest.approx(factor, rel=1e-15)
    assert (found.si, describe(found.dimension)) == (si, dimension)
    assert unit_of(dimension).dimension == found.dimension
    assert unit_of(found.si).plain


@pytest.mark.parametrize(
    ("one", "other"),
    [("V A", "W"), ("V/A", "ohm"), ("V s", "Wb"), ("ohm s", "H"), ("A s/V", "F"), ("N m/A", "V s")],
)
def test_electrical_and_mechanical_units_are_one_system(one: str, other: str) -> None:
    assert unit_of(one).dimension == unit_of(other).dimension != NONE


def test_every_unit_of_the_table_can_be_read_back_from_its_si_unit() -> None:
    for name, entry in ENTRIES.items():
        assert unit_of(entry.si).dimension == unit_of(name).dimension
        assert unit_of(entry.si).plain


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("(N m)/((rad/s)*(rad/s))", "N m s^2/rad^2"),
        ("N/(m*m*m)", "N/m^3"),
        ("(V)/(V)", "1"),
        ("1/(mm/s)", "s/mm"),
        ("l/(min bar^0.5)", "l/(min bar^(1/2))"),
        ("(m/s)^2/kg/K", "m^2/(s^2 kg K)"),
        ("degC", "degC"),
        ("", ""),
    ],
)
def test_brackets_of_a_unit_are_multiplied_out(text: str, plain: str) -> None:
    assert simplified(text) == plain
    if text:
        assert (unit_of(plain).dimension, unit_of(plain).factor) == (
            unit_of(text).dimension,
            pytest.approx(unit_of(text).factor),
        )


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-300, 7.3e9, -0.0, math.inf, -math.inf])
@pytest.mark.parametrize("text", ["N s/m", "m/s^2", "N/(m/s)", "V", "1", "", "m/(s V)", "kg m^2"])
def test_a_value_that_is_si_stays_to_the_bit(text: str, value: float) -> None:
    unit = unit_of(text)
    assert np.float64(unit.to_si(value)).tobytes() == np.float64(value).tobytes()
    assert np.float64(unit.from_si(value)).tobytes() == np.float64(value).tobytes()


def test_a_value_is_what_a_person_computes() -> None:
    for text, written, si in [("mm", 0.7, 0.0007), ("ms", 3.3, 0.0033), ("bar", 5.1, 510000.0)]:
        assert unit_of(text).to_si(written) == si
        assert unit_of(text).from_si(si) == written


def test_a_temperature_alone_has_an_offset() -> None:
    assert unit_of("degC").to_si(20.0) == 293.15
    assert unit_of("degF").to_si(212.0) == pytest.approx(373.15, abs=1e-12)
    assert Parameter(value=20.0, unit="degC", low=-10.0).low == 263.15


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kips", "unknown unit 'kips', expected a known one: did you mean 'kip'?"),
        ("kN/mmm", "unknown unit 'mmm' in 'kN/mmm', expected a known one: did you mean 'mm'?"),
        ("Mpa", "did you mean 'MPa'?"),
        ("sec", "did you mean 's'?"),
        ("furlong", "'furlong', expected a known one: m, mm, kg"),
        ("cmH2O", "in 'cmH2O', expected a known one: did you mean 'cmWC'?"),
        ("N/(m", "expected as many '(' as ')'"),
        ("N)", "expected as many '(' as ')'"),
        ("N ? m", "cannot be read from '? m' on"),
    ],
)
def test_an_unknown_unit_is_one_line_with_a_suggestion(text: str, said: str) -> None:
    with pytest.raises(UnitError) as error:
        unit_of(text)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_numbers_of_a_model_are_si_and_keep_the_unit_to_show() -> None:
    k = parse(SPRING, Model, "spring").parameters["k"]
    assert (k.value, k.unit, k.shown) == (2e6, "N/m", "kN/mm")
    p = Parameter(value=3.0, unit="bar", low=1.0, high=6.0)
    assert (p.value, p.low, p.high, p.unit, p.shown) == (3e5, 1e5, 6e5, "Pa", "bar")
    s = State(unit="mm", derivative="v", start=1.0, low=-2.0)
    assert (s.start, s.low, s.unit) == (1e-3, -2e-3, "m")


def test_a_unit_that_is_unknown_is_reported_with_file_line_and_key() -> None:
    with pytest.raises(ConfigError, match=r"spring.toml:9: parameters.k.unit: .*did you mean 'kN'"):
        parse(SPRING.replace("kN/mm", "kNN/mm"), Model, "spring.toml")
    with pytest.raises(ConfigError, match=r"parameters.gap.unit: found the unknown unit 'mmm'"):
        parse(STOP.replace('"mm"', '"mmm"'), EffectFile, "stop.toml")


def test_a_unit_to_show_has_to_measure_the_same() -> None:
    assert Parameter(value=3.0, unit="m", shown="mm").value == 3.0
    with pytest.raises(UnitError, match="'bar' to show it in, expected a unit in m"):
        Parameter(value=3.0, unit="m", shown="bar")


def test_numbers_of_an_effect_are_si_at_its_port() -> None:
    stop = parse(STOP, EffectFile, "stop.toml").effects["stop"]
    gap = stop.parameters["gap"]
    assert (gap.value, gap.low, gap.high, gap.tried) == (5e-4, 1e-4, 2e-3, (2e-4, 4e-4))
    system = compose(parse(SPRING, Model, "spring"), [Placement("stop", stop, "load")])
    k = system.parameters["load_stop_k"]
    assert (k.value, k.unit, k.shown) == (3e6, "N/m", "kN/mm")
    assert system.parameters["load_stop_gap"].shown == "mm"


def test_shares_of_a_signal_are_si_whatever_the_unit_to_show() -> None:
    p = EffectParameter(unit="mm", value=0.5, scale="x", role="strength", high=1.0)
    effect = Effect(port="force", expression="b", physics="p", source="s", parameters={"b": p})
    scaled = effect.scaled({"x": 0.02}).parameters["b"]
    assert (scaled.value, scaled.high, scaled.unit, scaled.shown) == (0.01, 0.02, "m", "mm")


def test_the_back_emf_of_a_motor_is_a_damping() -> None:
    system = compose(parse(MOTOR, Model, "motor"))
    assert system.derivatives["w"] is not None
    wrong = MOTOR.replace("kt**2/R", "kt/R")
    with pytest.raises(ModelError, match="state w: found 'd \\+ kt / R' with units"):
        compose(parse(wrong, Model, "motor"))


def test_a_caret_gets_the_hint_at_two_stars() -> None:
    with pytest.raises(ModelError, match=r"which is no arithmetic: write \*\* for a power"):
        compose(parse(MOTOR.replace("kt**2", "kt^2"), Model, "motor"))


@pytest.mark.parametrize("unit", ["g", "mg"])
def test_the_gram_where_gravity_is_meant_gets_a_hint(unit: str) -> None:
    text = SPRING.replace('"k*position + load"', '"m*gravity + load"')
    text += '[parameters.m]\nvalue = 2.0\nunit = "kg"\n'
    text += f'[parameters.gravity]\nvalue = 1.0\nunit = "{unit}"\n'
    with pytest.raises(ModelError, match="g is the gram, write g0 for standard gravity"):
        compose(parse(text, Model, "spring"))
    fine = compose(parse(text.replace(f'"{unit}"', '"g0"'), Model, "spring"))
    assert fine.parameters["gravity"].value == 9.80665


@pytest.mark.parametrize(
    ("expression", "hint"),
    [
        pytest.param("m*9.81", "(a number has no unit: make it a parameter", id="a number"),
        pytest.param("load - 20", "(a number has no unit: make it a parameter", id="one taken off"),
        pytest.param("max(load, 1000)", "(a number has no unit: make it", id="a bound"),
        pytest.param(
            "where(load > 3, load, 0)", "(a number has no unit: make it", id="one compared with"
        ),
        pytest.param("m*position", "", id="neither"),
    ],
)
def test_a_mass_in_grams_gets_the_hint_that_its_equation_needs(expression: str, hint: str) -> None:
    text = SPRING.replace('"k*position + load"', f'"{expression}"')
    text += '[parameters.m]\nvalue = 2.0\nunit = "g"\n'
    with pytest.raises(ModelError, match="found") as refused:
        compose(parse(text, Model, "spring"))
    assert "is the gram" not in str(refused.value)
    assert hint in str(refused.value)
    assert hint or "no unit" not in str(refused.value)


def test_the_same_model_in_other_units_has_the_same_fit() -> None:
    position = np.sin(np.arange(400) / 9)[:, None] * 1e-3
    force = 3e6 * position + 5.0 * np.random.default_rng(1).normal(size=(400, 1))
    recording = Recording(0.01, position, force)
    si = SPRING.replace("value = 2.0", "value = 2e6").replace("kN/mm", "N/m")
    found = [
        fit(compile_system(compose(parse(text, Model, "spring"))), recording, 400).values()["k"]
        for text in (SPRING, si)
    ]
    assert found[0] == found[1] == pytest.approx(3e6, rel=1e-2)

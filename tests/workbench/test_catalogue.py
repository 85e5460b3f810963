"""Effects and models described, drawn and checked; the guide's models are as good as it says."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.commands.catalogue.effect_table import listed
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import Model, shipped_models
from rigwatch.wire.typed_files.loading import parse
from rigwatch.workbench.catalogue import (
    draft_of_model,
    effect_curves,
    inputs_of_run,
    model_report,
    text_plot,
)
from tests.workbench.studies.test_recordings_apart import DAMPER

GUIDE = Path(__file__).parents[2] / "docs" / "models.md"
SNIPPETS = re.findall(r"```toml\n(.*?)```", GUIDE.read_text("utf-8"), re.DOTALL)
UNSEEN = """
name = "unseen"
summary = "Two masses of which one is read."
inputs.force = { unit = "N" }
parameters.m = { value = 2.0, unit = "kg" }
parameters.spare = { value = 2.0, unit = "kg" }
quantities.never = { expression = "m*v", unit = "kg m/s" }
states.v = { unit = "m/s", derivative = "force/m", measured = "speed" }
states.x = { unit = "m", derivative = "v" }
states.a = { unit = "m/s", derivative = "-a/(1.0*tau)" }
states.b = { unit = "m/s", derivative = "-b/tau" }
parameters.tau = { value = 0.5, unit = "s" }
outputs.speed = { unit = "m/s", expression = "v + a - b" }
"""


@pytest.mark.parametrize("text", SNIPPETS, ids=[s.split('"')[1] for s in SNIPPETS])
def test_a_model_of_the_guide_can_work(text: str) -> None:
    assert model_report(parse(text, Model, "guide"), {}).fine


@pytest.mark.parametrize("name", sorted(shipped_models()))
def test_a_model_that_ships_can_work(name: str) -> None:
    given = {"outside": 1e5} if name == "vessel" else {}
    assert model_report(shipped_models()[name], given).fine


def test_what_no_output_shows_and_nothing_uses_is_reported() -> None:
    found = model_report(parse(UNSEEN, Model, "unseen"), {})

    assert not found.fine
    assert found.unused == ("spare", "never")
    assert found.unseen == ("x",)
    assert found.tied == ("a", "b")
    assert found.start == ("x", "a", "b")


CYLINDER = """
name = "cylinder"
summary = "A piston moved by oil, of which only the position is read."
inputs.flow = { unit = "m^3/s" }
parameters.A = { value = 6e-4, unit = "m^2" }
parameters.m = { value = 28.0, unit = "kg" }
parameters.b = { value = 500.0, unit = "N s/m" }
parameters.Cp = { value = 1e-13, unit = "m^3/Pa" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(A*p - b*v)/m", rate_of = "position" }
states.p = { unit = "Pa", derivative = "(flow - A*v)/Cp" }
states.oil = { unit = "m^3", derivative = "flow" }
outputs.position = { unit = "mm", expression = "x" }
"""


def test_a_pressure_in_pascal_is_seen_in_a_position_and_what_it_does_not_move_is_not() -> None:
    assert model_report(parse(CYLINDER, Model, "cylinder"), {}).unseen == ("oil",)


VESSEL = """
name = "gas"
summary = "A vessel that empties through a valve."
inputs.flow = { unit = "1/s" }
states.p = { unit = "Pa", derivative = "-flow*pa**2/p", measured = "pressure" }
parameters.pa = { value = 1e5, unit = "Pa", fixed = true, low = 8e4, high = 1.1e5 }
outputs.pressure = { unit = "Pa", expression = "p" }
"""


def test_a_run_that_diverges_tells_what_it_began_with() -> None:
    model = parse(VESSEL, Model, "gas")
    trouble = "the run diverged from p = 0 (`start` gives another): found NaN or infinite values"
    assert model_report(model, {}).trouble.startswith(trouble)
    begun = VESSEL.replace('measured = "pressure"', 'measured = "pressure", start = 6e5')
    assert not model_report(parse(begun, Model, "gas"), {"flow": 1e-3}).trouble


SURROUNDED = """
name = "surrounded"
summary = "A block that cools to its surroundings."
inputs.ambient = { unit = "K" }
inputs.wall = { unit = "degC" }
states.T = { unit = "K", derivative = "(ambient + wall - 2*T)/tau", measured = "T", start = 280.0 }
parameters.tau = { value = 5.0, unit = "s" }
outputs.T = { unit = "K", expression = "T" }
"""


def test_surroundings_that_are_not_given_are_as_warm_as_the_machine() -> None:
    report = model_report(parse(SURROUNDED, Model, "surrounded"), {"wall": 6.85 + 10.0})
    assert report.inputs == {"ambient": pytest.approx(280.0), "wall": pytest.approx(16.85)}
    assert report.run[0].y[-1] == pytest.approx(285.0, abs=0.1)


def test_an_input_in_kelvin_may_be_a_difference(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "surrounded.toml"
    file.write_text(SURROUNDED)
    main(["model", "check", str(file)])
    told = "(others: --input NAME=VALUE; ambient if a difference, as a warming: --input ambient=20)"
    assert told in capsys.readouterr().out


def test_parameters_of_which_the_same_is_said_share_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "free.toml"
    more = 'parameters.g = { value = 9.8, unit = "m/s^2", fixed = true }\n'
    more += 'parameters.h = { value = 2.0, unit = "m", fixed = true }\n'
    file.write_text(UNSEEN.replace('"-b/tau"', '"-b/tau*g/g*h/h"') + more)
    main(["model", "check", str(file)])
    assert "  g, h: fixed and without bounds" in capsys.readouterr().out


NEVER_NEGATIVE = ("kg", "kg m^2", "m^2", "m^3", "ohm", "H", "J/K")
"""Units of masses, inertias, areas, volumes, resistances, inductances and heat capacities."""


@pytest.mark.parametrize("name", sorted(shipped_models()))
def test_what_cannot_be_negative_is_bounded_in_every_model_that_ships(name: str) -> None:
    model = shipped_models()[name]
    sets = [model.parameters, *(variant.parameters for variant in model.variants.values())]
    sized = {n: p for each in sets for n, p in each.items() if p.unit in NEVER_NEGATIVE}
    assert not {n: p.low for n, p in sized.items() if p.low < 0}


def test_a_fixed_parameter_without_bounds_is_reported() -> None:
    text = UNSEEN + 'parameters.given = { value = 2.0, unit = "1", fixed = true }\n'
    assert model_report(parse(text, Model, "given"), {}).unbounded == ("given",)
    assert not model_report(parse(UNSEEN, Model, "unseen"), {}).unbounded
    bounded = text.replace("fixed = true", "fixed = true, low = 0.0")
    assert not model_report(parse(bounded, Model, "given"), {}).unbounded


@pytest.mark.parametrize("sign", ["-", "+"])
def test_a_motion_that_grows_by_itself_is_reported(sign: str) -> None:
    roll = f"""
name = "ship"
summary = "A ship that rolls."
inputs.moment = {{ unit = "N m" }}
states.phi = {{ unit = "rad", derivative = "p" }}
states.p = {{ unit = "rad/s", derivative = "(moment - b*p {sign} G*phi)/I" }}
parameters.I = {{ value = 2.0, unit = "kg m^2", low = 0.1 }}
parameters.b = {{ value = 0.4, unit = "N m s/rad", low = 0.0 }}
parameters.G = {{ value = 30.0, unit = "N m/rad", low = 1.0 }}
outputs.roll = {{ unit = "deg", expression = "phi" }}
"""
    report = model_report(parse(roll, Model, "ship"), {})
    assert report.growing == (("phi", "p") if sign == "+" else ())
    assert report.fine


@pytest.mark.parametrize("name", sorted(shipped_models()))
def test_no_model_that_ships_grows_by_itself(name: str) -> None:
    assert not model_report(shipped_models()[name], {}).growing


def test_what_suits_a_port_is_counted_and_a_variable_that_no_effect_reads_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    speed = '= { expression = "v", unit = "m/s" }'
    port = f'ports.hand = {{ kind = "force", unit = "N", variables.v {speed} }}\n'
    text = UNSEEN.replace('"force/m"', '"(force + hand)/m"') + port
    named = model_report(parse(text, Model, "hand"), {})
    assert not named.unread
    assert named.entering["hand"] > 20

    file = tmp_path / "hand.toml"
    file.write_text(text.replace("variables.v ", "variables.velocity "))
    main(["model", "check", str(file)])
    said = capsys.readouterr().out
    assert "hand.velocity: no effect of the library uses a variable of this name" in said
    assert "suit its ports: 2 at hand" in said


def test_every_effect_is_drawn_and_does_something() -> None:
    for name, effect in library().items():
        curves = effect_curves(effect)
        assert all(np.isfinite(curve.y).all() for curve in curves), name
        straight = all(np.allclose(c.y, c.x) for c in curves if c.across == "arrives")
        forced = effect.port == "force" and any(np.any(c.y != 0) for c in curves)
        assert forced or not straight or (effect.port != "force" and np.ptp(curves[1].y)), name
        assert text_plot(curves[0])[0].endswith(curves[0].across)


def test_a_dry_contacts_loop_is_the_closed_form() -> None:
    """Dahl's contact slips where it was moved far: ±Fc, entered as an exponential of the way."""
    loop = effect_curves(library()["dahl"])[0]

    assert loop.y.max() == pytest.approx(0.5, rel=1e-3)
    assert loop.y.min() == pytest.approx(-0.5, rel=1e-3)


def test_all_effects_are_listed_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert sorted(n for found in listed().values() for n in found) == sorted(library())

    assert main(["effects"]) == 0
    said = capsys.readouterr().out
    assert all(f"  {name} " in said for name in library())


def test_curves_of_all_effects_are_not_saved(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", "--save", "all.svg"]) == 2
    assert "--save: found no effect to draw" in capsys.readouterr().err


def test_an_effect_is_described_and_saved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["effects", "dahl", "--json", "--save", str(tmp_path / "dahl.svg")]) == 0

    told = json.loads(capsys.readouterr().out)
    assert told["effect"]["source"].startswith("P. R. Dahl")
    assert len(told["curves"]) == 3
    assert (tmp_path / "dahl.svg").read_text("utf-8").startswith("<svg")
    assert (tmp_path / "dahl_3.svg").is_file()
    assert main(["effects", "dall"]) == 2
    assert "did you mean" in capsys.readouterr().err


def test_a_model_is_begun_and_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.toml"
    assert main(["model", "new", str(file), "--like", "two-mass-drive"]) == 0
    assert main(["model", "check", str(file), "--save", str(tmp_path / "run.svg")]) == 0
    assert "angle: no output depends on it" in capsys.readouterr().out
    assert (tmp_path / "run_2.svg").is_file()

    assert main(["model", "new", str(file)]) == 2
    assert "the file exists already" in capsys.readouterr().err
    assert main(["model", "check", str(file), "--input", "torque=1"]) == 2
    assert "found input 'torque'" in capsys.readouterr().err
    assert main(["model", "list", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)) == set(shipped_models())
    assert main(["model", "show", "bearing"]) == 0
    assert 'name = "bearing"' in capsys.readouterr().out


WARM = """
name = "warm"
summary = "A block whose temperature is shown in degC."
inputs.u = { unit = "1" }
states.T = { unit = "degC", derivative = "(k*u - (T - Ta))/tau", measured = "T", start = 20.0 }
parameters.k = { value = 30.0, unit = "UNIT" }
parameters.Ta = { value = 20.0, unit = "degC" }
parameters.tau = { value = 5.0, unit = "s" }
outputs.T = { unit = "degC", expression = "T" }
"""


@pytest.mark.parametrize(("unit", "told", "end"), [("K", (), 50.0), ("degC", ("k",), 323.15)])
def test_a_run_is_drawn_in_the_units_shown_and_absolute_factors_are_told(
    unit: str, told: tuple[str, ...], end: float
) -> None:
    text = WARM.replace("UNIT", unit)
    report = model_report(parse(text, Model, "warm"), {})
    assert report.fine
    assert report.absolute == told
    in_browser = [one.text for one in draft_of_model(text, "warm").problems]
    assert any("that multiplies something" in said for said in in_browser) == bool(told)
    (curve,) = report.run
    assert curve.up == "T [degC]"
    assert curve.y[0] == pytest.approx(20.0)
    assert curve.y[-1] == pytest.approx(end, abs=0.5)


def test_a_model_without_states_has_no_run_and_is_told_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "damper.toml"
    file.write_text(DAMPER)
    assert main(["model", "check", str(file)]) == 0
    assert "no run is drawn: without states" in capsys.readouterr().out


def test_the_inputs_of_a_run_are_in_the_units_of_the_file() -> None:
    text = WARM.replace('inputs.u = { unit = "1" }', 'inputs.u = { unit = "kW" }')
    model = parse(text.replace("UNIT", "K/kW"), Model, "warm")
    report = model_report(model, {"u": 3.0})
    assert inputs_of_run(model, report) == "u = 3 kW"
    assert report.run[0].y[-1] == pytest.approx(20.0 + 3 * 30.0, abs=1.0)

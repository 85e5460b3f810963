"""An effect that is refused alone is added where the whole set that it belongs to supports it."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.steps.change import add
from rigwatch.workbench.steps.ledger_replay import replay
from rigwatch.workbench.study.ledger import lines
from rigwatch.workbench.study.study import open_study
from sim_plant.machines import MACHINES, log, strength_for
from tests.workbench.machine import studied

HIDDEN = ("saturation", "coulomb", "drag_by_direction")
KEYS = "horizon = 0.3\nstart = { R = 2.0, K = 0.06 }"
UNITS = {"voltage": "V", "speed": "rad/s"}
OTHERS = ("saturation@drive", "coulomb@shaft")


@pytest.fixture(scope="module")
def motor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A motor with three hidden effects, of which drag by direction shows little alone."""
    model = (resources.files("rigwatch.physics") / "models" / "motor.toml").read_text("utf-8")
    train, held_out = ([recorded(seed)] for seed in (102, 1102))
    rates = [MACHINES["motor"].rate] * 2
    return studied(
        tmp_path_factory.mktemp("motor"), model, train, held_out, UNITS, KEYS, rates
    ).folder


def recorded(seed: int) -> dict[str, np.ndarray]:
    """A log of the motor; each effect alone changes its speed by a tenth."""
    plant = MACHINES["motor"]
    hidden = {name: strength_for(plant, name, 0.1, 102) for name in HIDDEN}
    table = log(plant, hidden, 0.002, seed)
    return {"voltage": table["voltage_V"], "speed": table["speed_rad_s"]}


def test_an_effect_that_has_no_place_in_the_set_is_refused(motor: Path) -> None:
    change = add(open_study(motor), "curvature", "speed_sensor", beside=OTHERS[1:])
    assert change.step == "refused"
    assert " with " in change.text
    assert open_study(motor).file.effects == ()


@pytest.mark.parametrize(
    ("others", "message"),
    [
        (("viscous_by_direction@shaft",), "expected each effect once"),
        (("saturation@drive", "saturation@drive"), "expected each effect once"),
        (("saturation@drift",), "found no port 'drift'"),
        (("saturatoin@drive",), "saturatoin"),
    ],
)
def test_a_set_that_makes_no_sense_is_one_plain_line(
    motor: Path, others: tuple[str, ...], message: str
) -> None:
    with pytest.raises(ModelError, match=message) as error:
        add(open_study(motor), "viscous_by_direction", "shaft", beside=others)
    assert "\n" not in str(error.value)


def test_with_the_set_it_is_added_and_the_ledger_has_the_evidence(motor: Path) -> None:
    change = add(open_study(motor), "viscous_by_direction", "shaft", beside=OTHERS)
    assert change.step == "add"
    assert change.after.held_out_error > 0.75 * change.before.held_out_error
    assert "with saturation@drive, coulomb@shaft: held-out error " in change.text
    changed = open_study(motor)
    assert [each.effect for each in changed.file.effects] == ["viscous_by_direction"]
    *_, line = lines(changed)
    assert line["set"]["with"] == list(OTHERS)
    assert line["set"]["held_out_error"] < 0.1 * line["set"]["without_held_out_error"]
    assert line["held_out_error"] > 10 * line["set"]["held_out_error"]
    assert all(check.same for check in replay(changed))


def test_an_effect_is_added_at_a_port_as_the_ranking_writes_it(
    motor: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["add", str(motor), "curvature@speed_sensor", "--port", "drive"]) == 2
    assert "found curvature@speed_sensor with --port drive" in capsys.readouterr().err
    main(["add", str(motor), "curvature@speed_sensor"])
    assert capsys.readouterr().out.startswith("curvature@speed_sensor: ")

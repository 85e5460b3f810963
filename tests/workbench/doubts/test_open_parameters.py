"""What the base model leaves open may have run off: fits also begin where it was given."""

from types import SimpleNamespace
from typing import Any

import pytest

from rigwatch.physics.engine.equations import Placement, parse_model
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.workbench.ranking import Ranked, refitting
from rigwatch.workbench.ranking.refitting import _given_of_open

BLOCK = """
name = "block"
summary = "A heated block on a base."
inputs.power = { unit = "W" }
states.T = { unit = "K", derivative = "(power - G*(T - Tb) + loss)/C", measured = "block" }
states.Tb = { unit = "K", derivative = "(G*(T - Tb))/Cb" }
parameters.C = { value = 500.0, unit = "J/K" }
parameters.Cb = { value = 2000.0, unit = "J/K" }
parameters.G = { value = 1.0, unit = "W/K" }
outputs.block = { unit = "K", expression = "T" }
[ports.loss]
kind = "force"
unit = "W"
variables.T = { expression = "T", unit = "K" }
variables.Ta = { expression = "0*T", unit = "K" }
"""


@pytest.mark.parametrize(
    ("left_open", "told", "given"),
    [
        pytest.param((), {}, {}, id="all determined"),
        pytest.param(("Cb",), {}, {"Cb": 2000.0}, id="from the model file"),
        pytest.param(("Cb",), {"Cb": 1500.0}, {"Cb": 1500.0}, id="from the study"),
        pytest.param(("loss_radiation_e",), {}, {}, id="not the model's own"),
    ],
)
def test_fits_begin_where_open_parameters_were_given(
    left_open: tuple[str, ...], told: dict[str, float], given: dict[str, float]
) -> None:
    base: Any = SimpleNamespace(convergence=SimpleNamespace(undetermined=left_open))
    study: Any = SimpleNamespace(
        model=parse_model(BLOCK, "block.toml"), file=SimpleNamespace(start=told)
    )
    free: Any = SimpleNamespace(along_motion=False)
    assert _given_of_open(study, free, base) == given
    along: Any = SimpleNamespace(along_motion=True)
    assert _given_of_open(study, along, base) == {}


@pytest.mark.parametrize("open_after", [True, False])
def test_a_second_fit_is_made_where_the_first_leaves_the_parameter_open(
    open_after: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended, begun = {"C": 550.0, "Cb": 1e25, "G": 2.5}, list[float]()
    base: Any = SimpleNamespace(
        placements=(),
        train=SimpleNamespace(values=lambda: ended, scale=None),
        convergence=SimpleNamespace(undetermined=("Cb",)),
    )
    study: Any = SimpleNamespace(
        model=parse_model(BLOCK, "block.toml"), file=SimpleNamespace(start={})
    )
    placed = Placement("radiation", library()["radiation"], "loss")
    row = Ranked(placed, "force", 0.0, 0.5, {"e": 2e-9}, [], {}, {})
    free: Any = SimpleNamespace(along_motion=False)

    def fitting(*arguments: Any, **_: Any) -> Any:
        begun.append(arguments[3]["Cb"])
        assert arguments[3]["loss_radiation_e"] == 2e-9
        return SimpleNamespace(train=None, train_error=1.0)

    monkeypatch.setattr(refitting, "orders_at_port", lambda *_: [placed])
    monkeypatch.setattr(refitting, "undetermined", lambda _: ("Cb",) if open_after else ())
    monkeypatch.setattr(refitting, "judge_fit", lambda *_: None)
    refitting.refit(study, free, base, row, fitting)
    assert begun == ([1e25, 2000.0] if open_after else [1e25])

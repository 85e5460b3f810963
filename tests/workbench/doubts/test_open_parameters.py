"""What the base model leaves open may have run off: fits also begin where it was given."""

from types import SimpleNamespace
from typing import Any

import pytest

from rigwatch.physics.engine.equations import Placement, parse_model
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.workbench.ranking import Ranked
from rigwatch.workbench.ranking.refitting import _starts

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
    ("left_open", "told", "begun"),
    [
        pytest.param((), {}, [1e25], id="all determined"),
        pytest.param(("Cb",), {}, [1e25, 2000.0], id="from the model file"),
        pytest.param(("Cb",), {"Cb": 1500.0}, [1e25, 1500.0], id="from the study"),
        pytest.param(("loss_radiation_e",), {}, [1e25], id="not the model's own"),
    ],
)
def test_fits_begin_where_the_base_ended_and_where_open_parameters_were_given(
    left_open: tuple[str, ...], told: dict[str, float], begun: list[float]
) -> None:
    ended = {"C": 550.0, "Cb": 1e25, "G": 2.5}
    base: Any = SimpleNamespace(
        train=SimpleNamespace(values=lambda: ended),
        convergence=SimpleNamespace(undetermined=left_open),
    )
    study: Any = SimpleNamespace(
        model=parse_model(BLOCK, "block.toml"), file=SimpleNamespace(start=told)
    )
    placed = Placement("radiation", library()["radiation"], "loss")
    row = Ranked(placed, "force", 0.0, 0.5, {"e": 2e-9}, [], {}, {})
    free: Any = SimpleNamespace(along_motion=False)
    starts = _starts(study, free, base, row)
    assert [start["Cb"] for start in starts] == begun
    assert all(start["C"] == 550.0 and start["loss_radiation_e"] == 2e-9 for start in starts)
    along: Any = SimpleNamespace(along_motion=True)
    assert _starts(study, along, base, row) == starts[:1]

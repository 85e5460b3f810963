"""The split that is proposed excites both sides, and says of an input that it never changes."""

import re
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.workbench.compare.compare import compare
from rigwatch.workbench.data import proposed_split, unchanging
from rigwatch.workbench.data.columns import Columns
from rigwatch.workbench.data.proposals import Part
from tests.workbench.machine import studied
from tests.workbench.studies.test_own_model import PORT, SPEED, UNITS, run

WIND = 'inputs.w = { unit = "rad/s^2" }\n'


BLOCK = """
name = "block"
summary = "A block that is heated."
inputs.u = { unit = "1" }
states.T = { unit = "K", derivative = "(G*u - T)/tau", measured = "T" }
parameters.G = { value = 1.0, unit = "K", fixed = true, low = 0.0 }
parameters.tau = { value = 100.0, unit = "s", low = 1.0 }
outputs.T = { unit = "K", expression = "T" }
"""


def logged(u: np.ndarray) -> Columns:
    return Columns(0.01, {"u": u})


def test_a_log_is_cut_where_its_input_changes_on_both_sides() -> None:
    u = np.zeros(10_000)
    u[500:], u[2000:], u[9900:] = 1.0, 3.0, 2.99
    (train,), (held_out,) = proposed_split([logged(u)], ["u"])
    assert train.end == held_out.start
    assert 5.0 < train.end < 20.0


def test_a_log_that_changes_all_the_time_is_cut_as_ever() -> None:
    u = np.sin(np.arange(10_000) / 100)
    (train,), _ = proposed_split([logged(u)], ["u"])
    assert abs(train.end - 60.0) < 1.0


def test_a_log_in_which_nothing_changes_is_not_held_out() -> None:
    wave = np.sin(np.arange(3000) / 100)
    tables = [logged(wave), logged(np.full(3000, 0.5)), logged(0.9 * wave)]
    _, (held_out,) = proposed_split(tables, ["u"])
    assert held_out.recording == 2
    assert unchanging(tables[1], ["u"], Part(1)) == ["u"]
    assert not unchanging(tables[0], ["u"], Part(0))


def warmed(seed: int, noise: float) -> Columns:
    """A block at rest for 200 s, then heated in two steps; its time constant is 300 s."""
    u, warm = np.zeros(6000), np.zeros(6000)
    u[200:], u[700:] = 1.0, 3.0
    for k in range(1, len(u)):
        warm[k] = warm[k - 1] + (u[k - 1] - warm[k - 1]) / 300
    return Columns(1.0, {"u": u, "T": warm + noise * np.random.default_rng(seed).normal(size=6000)})


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.3])
def test_a_log_ends_where_the_machine_rests_not_where_its_input_does(noise: float) -> None:
    tables = [warmed(seed, noise) for seed in range(2)]
    for part in (
        *proposed_split(tables, ["u"], ["T"])[0],
        *proposed_split(tables, ["u"], ["T"])[1],
    ):
        assert part.start == 0.0 or 100 < part.start < 200
        assert 1000 < part.end < 3000


def test_why_a_part_of_a_log_is_left_out_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "block.toml").write_text(BLOCK)
    for seed in (0, 1):
        table = warmed(seed, 0.05).values
        rows = zip(np.arange(6000.0), table["u"], table["T"], strict=True)
        text = "\n".join(f"{t:g},{u:g},{warm:.6g}" for t, u, warm in rows)
        (tmp_path / f"run{seed}.csv").write_text(f"time_s,u [1],T [K]\n{text}\n")
    logs = [f"{tmp_path}/run{seed}.csv" for seed in (0, 1)]
    made = ["study", "new", f"{tmp_path}/study", "--model", f"{tmp_path}/block.toml", "--data"]
    assert main([*made, *logs]) == 0
    said = capsys.readouterr()
    assert re.search(r"run\d.csv from 0 s to \S+ s, as nothing moves after", said.err)
    assert (
        "give this machine's values with --set G=VALUE, or --set LOG:G=VALUE where logs differ"
        in said.err
    )


@pytest.mark.parametrize(("logs", "held_out"), [(2, 1), (5, 1), (6, 2), (8, 2), (16, 4)])
def test_of_six_logs_no_single_one_decides(logs: int, held_out: int) -> None:
    waves = [np.sin(np.arange(1000) / 100 + phase) for phase in range(logs)]
    train, decide = proposed_split([logged(wave) for wave in waves], ["u"])
    assert len(decide) == held_out
    assert len(train) == logs - held_out


def test_an_input_that_never_changes_is_told(tmp_path: Path) -> None:
    train, still = ({**run(seed), "w": np.full(1500, 0.5)} for seed in (0, 1))
    train["w"][700:] = 1.0
    model = SPEED.replace("load", "w + load")
    model = model.replace("states.v", WIND + "states.v", 1) + PORT
    study = studied(tmp_path, model, [train], [still], {**UNITS, "w": "rad/s^2"})
    told = [remark for remark in compare(study).remarks if "never changes" in remark]
    assert told == ["held out: w never changes; what it does there is a constant"]

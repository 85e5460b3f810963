"""Logs as loggers write them: lost rows, uneven times, ends that fill no window."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from benchmarks.explaining.machine_studies import machine_study
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.data import prepare
from rigwatch.workbench.explain.explain import explain, ranking
from rigwatch.workbench.study import Study
from sim_plant.machines import MACHINES
from sim_plant.machines.loggers import logged


def test_a_hidden_level_does_not_run_on_through_inputs_that_were_lost(tmp_path: Path) -> None:
    # 15 lost rows are a minute, as long as the tank's time constant: the level after them is not
    # what an interpolated pump gives, and no effect describes the difference.
    study = machine_study(tmp_path, "cascade", {"late_pump": 0.3}, 0.02, 1001, "lost")
    bench = open_bench(study)
    assert bench.data.train.breaks
    verdict = ranking(bench)[1]
    assert verdict.word == "missing_effect"
    assert {"lag@pump", "delay@pump"} & {*verdict.members}


@pytest.mark.parametrize("machine", ["motor", "tanks"])
def test_nothing_is_missing_where_only_the_times_are_uneven(tmp_path: Path, machine: str) -> None:
    found = explain(machine_study(tmp_path, machine, {}, 0.02, 1101, "uneven"))
    assert found.verdict == "nothing_missing"


def test_half_of_a_window_at_the_end_of_a_recording_counts(tmp_path: Path) -> None:
    study = machine_study(tmp_path, "motor", {}, 0.005, 1001)
    data = prepare(_with_horizon(study, 1.6))
    assert len(data.train) == 8 * 320  # of 2400 samples, which end in the middle of the last
    assert np.isfinite(data.train.outputs).sum() == 2400
    assert (data.train.inputs[2400:] == data.train.inputs[2399]).all()
    assert not any("not counted" in remark for remark in data.remarks)


def test_less_than_half_a_window_is_left_out_and_told(tmp_path: Path) -> None:
    study = machine_study(tmp_path, "motor", {}, 0.005, 1001)
    short = prepare(_with_horizon(study, 1.9))
    assert len(short.train) == 6 * 380
    told = (
        "train: the last 0.6 s of a recording are not counted, since they fill no horizon of 1.9 s;"
        " 95.0% of the samples are used"
    )
    assert told in short.remarks


def test_a_logger_states_the_times_at_which_it_reads() -> None:
    machine = MACHINES["tanks"]
    uneven = logged(machine, {}, 0.0, 3, "uneven")["time_s"]
    assert np.ptp(np.diff(uneven)) > 0.3 / machine.rate
    assert abs(uneven - np.arange(len(uneven)) / machine.rate).max() <= 0.25 / machine.rate + 1e-9
    slow = np.diff(logged(machine, {}, 0.0, 3, "clock")["time_s"])
    assert np.ptp(slow) < 1e-9
    assert 0.002 <= abs(slow[0] * machine.rate - 1) <= 0.01
    assert len(logged(machine, {}, 0.0, 3, "lost")["time_s"]) < len(uneven)
    with pytest.raises(ValueError, match="found logger 'clock'"):
        logged(MACHINES["damper"], {}, 0.0, 3, "clock")


def _with_horizon(study: Study, seconds: float) -> Study:
    return replace(study, file=structs.replace(study.file, horizon=seconds))

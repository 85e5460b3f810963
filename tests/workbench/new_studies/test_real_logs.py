"""Logs as loggers write them: lost rows, uneven times, ends that fill no window."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.data import prepare
from rigwatch.workbench.explain.explain import explain, ranking
from rigwatch.workbench.explain.verdict_calibration import cases_seen_logged, most_probably_wrong
from rigwatch.workbench.report.text_report import doubt_of
from rigwatch.workbench.steps import Logs, add, study_from_logs
from rigwatch.workbench.study import Study, open_study
from sim_plant.machines import MACHINES, log, strength_for
from sim_plant.machines.loggers import logged
from tests.workbench.simulated import COMMON, knowing

KNOWN = {
    "cascade": {"A1": 0.0031, "A2": 0.0026},
    "tanks": {"A1": 0.0028, "A2": 0.0032},
    "motor": {"R": 2.0, "K": 0.06},
}


@pytest.mark.nightly
def test_a_hidden_level_does_not_run_on_through_inputs_that_were_lost(tmp_path: Path) -> None:
    # 15 lost rows are a minute, as long as the tank's time constant: the level after them is not
    # what an interpolated pump gives, and no effect describes the difference.
    study = made(tmp_path, "cascade", 0.02, 1001, "lost", late_pump=0.3)
    bench = open_bench(knowing(study, *COMMON))
    assert bench.data.train.breaks
    verdict = ranking(bench)[1]
    assert verdict.word == "missing_effect"
    assert {"lag@pump", "delay@pump"} & {*verdict.members}


@pytest.mark.parametrize("machine", ["motor", "tanks"])
def test_nothing_is_missing_where_only_the_times_are_uneven(tmp_path: Path, machine: str) -> None:
    found = explain(made(tmp_path, machine, 0.02, 1101, "uneven"))
    assert found.verdict == "nothing_missing"
    cases, wrong = cases_seen_logged("nothing_missing")
    assert (found.like_this, found.unlike) == ((cases, wrong), "")
    assert found.wrong_at_most == most_probably_wrong(cases, wrong)
    said = f"of {cases} verdicts on simulated logs with such faults {wrong} was wrong"
    assert doubt_of(found).endswith(said)


def test_half_of_a_window_at_the_end_of_a_recording_counts(tmp_path: Path) -> None:
    study = made(tmp_path, "motor", 0.005, 1001)
    data = prepare(_with_horizon(study, 1.6))
    assert len(data.train) == 8 * 320  # of 2400 samples, which end in the middle of the last
    assert np.isfinite(data.train.outputs).sum() == 2400
    assert (data.train.inputs[2400:] == data.train.inputs[2399]).all()
    assert not any("not counted" in remark for remark in data.remarks)


@pytest.mark.nightly
def test_the_ends_that_count_are_those_of_the_first_step_after_it_too(tmp_path: Path) -> None:
    study = made(tmp_path, "motor", 0.005, 1004, saturation=0.1)
    first = open_bench(study).data
    assert len(first.train) > np.isfinite(first.train.outputs).sum()
    assert add(study, "saturation", "drive").step == "add"
    later = open_bench(open_study(study.folder)).data
    assert later.horizon == first.horizon
    np.testing.assert_array_equal(later.train.outputs, first.train.outputs)


def test_less_than_half_a_window_is_left_out_and_told(tmp_path: Path) -> None:
    study = made(tmp_path, "motor", 0.005, 1001)
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


def made(
    folder: Path, name: str, noise: float, seed: int, logger: str = "", **share: float
) -> Study:
    """The study of two logs of a machine, as its user makes it."""
    plant = MACHINES[name]
    hidden = {effect: strength_for(plant, effect, share[effect], seed) for effect in share}
    paths = []
    for own in (seed, seed + 1000):
        table = (
            logged(plant, hidden, noise, own, logger) if logger else log(plant, hidden, noise, own)
        )
        paths.append(folder / f"run{own}.csv")
        rows = np.column_stack(list(table.values()))
        np.savetxt(paths[-1], rows, delimiter=",", header=",".join(table), comments="", fmt="%.9g")
    return study_from_logs(folder / "study", Logs(tuple(paths), name, start=KNOWN[name]))[0]


def _with_horizon(study: Study, seconds: float) -> Study:
    return replace(study, file=structs.replace(study.file, horizon=seconds, half_windows=True))

"""The series of memory that a long run keeps, and the steps that are found in it."""

from pathlib import Path

from tools.memory_series import Memory

BEFORE, AT, RISE = 30_000.0, 60, 1_024.0


def series(kb: list[float], pid: int = 7) -> Memory:
    memory = Memory()
    memory.seen["witness"] = [(pid, one) for one in kb]
    memory.at_s = [9.0 * look for look in range(len(kb))]
    return memory


def noisy(level: float, number: int) -> list[float]:
    return [level + 40.0 * (i % 3) for i in range(number)]


def test_a_rise_that_stays_is_found_once_at_its_session() -> None:
    memory = series([*noisy(BEFORE, AT), *noisy(BEFORE + RISE, 100)])
    [(at, rise)] = memory.steps("witness")
    assert abs(at - AT) <= 3
    assert abs(rise - RISE) < 60.0


def test_two_steps_are_two() -> None:
    levels = (BEFORE, BEFORE + RISE, BEFORE + 2 * RISE)
    memory = series([kb for level in levels for kb in noisy(level, 40)])
    assert [round(at, -1) for at, _ in memory.steps("witness")] == [40, 80]


def test_a_passing_peak_and_a_slow_rise_are_no_steps() -> None:
    peak = [*noisy(BEFORE, 50), BEFORE + RISE, *noisy(BEFORE, 50)]
    slow = [BEFORE + 10.0 * i for i in range(200)]
    assert series(peak).steps("witness") == []
    assert series(slow).steps("witness") == []


def test_only_the_process_that_lived_last_is_judged() -> None:
    memory = series(noisy(BEFORE, 50), pid=1)
    memory.seen["witness"] += series(noisy(BEFORE + RISE, 50), pid=2).seen["witness"]
    assert memory.steps("witness") == []


def test_growth_is_told_by_the_hour_with_how_sure_it_is() -> None:
    steady = series([BEFORE + 3.0 * i for i in range(400)]).growth("witness")
    assert steady.looks == 200
    assert steady.hours == 199 * 9.0 / 3600.0
    assert abs(steady.an_hour - 100.0 * 3.0 * 400 / (BEFORE + 900.0)) < 0.1
    assert steady.unsure < 0.01 * steady.percent

    one_step = series([*noisy(BEFORE, 300), *noisy(BEFORE + RISE, 100)]).growth("witness")
    assert one_step.unsure > one_step.percent / 2, "another run may have had none, or two"
    assert series(noisy(BEFORE, 400)).growth("witness").unsure < 0.1


def test_the_table_has_each_look_at_each_process(tmp_path: Path) -> None:
    memory = series([BEFORE, BEFORE + 1.0])
    memory.seen["daq"] = [(3, 90_000.0)]
    memory.write(tmp_path / "memory.csv")
    assert (tmp_path / "memory.csv").read_text().split() == [
        "session,process,pid,kb", "0,witness,7,30000.0", "1,witness,7,30001.0", "0,daq,3,90000.0",
    ]  # fmt: skip

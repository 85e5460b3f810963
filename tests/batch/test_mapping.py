"""`rigwatch.map`: the same bytes whatever does the work, and results that are kept."""

import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import polars
import pytest

import rigwatch
from rigwatch.batch import Outcome, executor_on
from rigwatch.batch.drive import LARGEST_TASK, RETRIES, SHORTEST_TASK_S, Drive
from rigwatch.batch.job import pack
from rigwatch.batch.pool import Pool
from rigwatch.wire.errors import BatchError
from tests.batch.jobs import ROOT, counted, make_files, sizes
from tests.waiting import eventually

COUNT = 40


@pytest.fixture
def files(tmp_path: Path) -> Path:
    folder = make_files(tmp_path / "sessions", COUNT)
    (folder / "run0007.mcap").write_text("broken")
    return folder


@pytest.fixture
def plain(files: Path, tmp_path: Path) -> bytes:
    """The file of a plain loop."""
    target = tmp_path / "plain.jsonl"
    rigwatch.map(sizes, [files], results=target)
    return target.read_bytes()


@pytest.mark.parametrize(
    "make",
    [lambda: ThreadPoolExecutor(3), lambda: ProcessPoolExecutor(1), lambda: ProcessPoolExecutor(3)],
    ids=["threads", "one process", "three processes"],
)
def test_the_executor_and_the_order_do_not_matter(files, plain, tmp_path, make):
    backwards = sorted(files.glob("*.mcap"), reverse=True)
    for ending in ("jsonl", "parquet"):
        rigwatch.map(sizes, backwards, results=tmp_path / f"again.{ending}", executor=make())
    rigwatch.map(sizes, [files], results=tmp_path / "plain.parquet")
    assert (tmp_path / "again.jsonl").read_bytes() == plain
    parquet = [(tmp_path / f"{name}.parquet").read_bytes() for name in ("again", "plain")]
    assert parquet[0] == parquet[1]


def test_a_table_of_results_has_a_row_per_unit_and_a_column_per_figure(files, tmp_path):
    found = rigwatch.map(sizes, [files], results=tmp_path / "out.parquet")
    table = polars.read_parquet(tmp_path / "out.parquet")
    assert table["path"].to_list() == sorted(map(str, files.glob("*")))
    assert table["number"].to_list() == [n if n != 7 else None for n in range(COUNT)]
    assert table["third"][6] == 2.0
    assert dict(found)[table["path"][1]] == {
        "number": 1,
        "third": 1 / 3,
        "name": "run0001.mcap",
        "list": [1, 2],
    }


def test_failures_are_named_in_one_line_and_the_rest_is_done(files):
    found = rigwatch.map(sizes, [files])
    assert (found.done, found.failed) == (COUNT - 1, {"ValueError": 1})
    assert found.summary() == "39 done, 1 failed: 1 ValueError"
    (failure,) = found.failures()
    assert failure.error == f"{files}/run0007.mcap: found the word broken, expected a number"


@pytest.mark.parametrize("ending", ["jsonl", "parquet"])
def test_only_new_and_changed_recordings_are_worked_on(tmp_path, ending):
    files, log = make_files(tmp_path / "sessions", 5), tmp_path / "log"
    target = tmp_path / f"out.{ending}"

    def again() -> list[str]:
        log.write_text("")
        rigwatch.map(counted, [files], results=target, log=str(log))
        return log.read_text().split()

    assert len(again()) == 5
    first = target.read_bytes()
    assert again() == []
    assert target.read_bytes() == first
    (files / "run0003.mcap").write_text("33")
    (files / "run0009.mcap").write_text("9")
    assert again() == ["run0003.mcap", "run0009.mcap"]
    whole = tmp_path / f"whole.{ending}"
    rigwatch.map(counted, [files], results=whole, log=str(log))
    assert target.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize("ending", ["jsonl", "parquet"])
def test_a_run_with_a_part_of_the_recordings_keeps_the_results_of_the_others(tmp_path, ending):
    files, log = make_files(tmp_path / "sessions", 5), tmp_path / "log"
    target, whole = tmp_path / f"out.{ending}", tmp_path / f"whole.{ending}"
    (files / "run0004.mcap").write_text("broken")
    rigwatch.map(counted, [files], results=target, log=str(log))
    log.write_text("")
    (files / "run0003.mcap").write_text("33")
    part = [files / "run0003.mcap", files / "run0001.mcap"]
    found = rigwatch.map(counted, part, results=target, log=str(log))
    assert log.read_text().split() == ["run0003.mcap"]
    assert [Path(path).name for path, _ in found] == ["run0001.mcap", "run0003.mcap"]
    assert (found.done, found.failed, list(found.failures())) == (2, {}, [])
    log.write_text("")
    rigwatch.map(counted, [files], results=target, log=str(log))
    assert log.read_text().split() == ["run0004.mcap"], "only what had failed"
    rigwatch.map(counted, [files], results=whole, log=str(log))
    assert target.read_bytes() == whole.read_bytes()
    rigwatch.map(counted, [files / ".." / "sessions"], results=target, log=str(log))
    found = rigwatch.map(counted, [files], results=target, log=str(log))
    assert (found.done, found.failed) == (4, {"ValueError": 1})
    assert target.read_bytes() == whole.read_bytes(), "a recording by another path is the same"


def test_failed_units_are_tried_again(files, tmp_path):
    target = tmp_path / "out.jsonl"
    rigwatch.map(sizes, [files], results=target)
    (files / "run0007.mcap").write_text("7")
    assert rigwatch.map(sizes, [files], results=target).failed == {}


@pytest.mark.parametrize("ending", ["jsonl", "parquet"])
def test_a_client_that_is_killed_continues_where_it_was(files, plain, tmp_path, ending):
    target = tmp_path / f"out.{ending}"
    journal = target if ending == "jsonl" else tmp_path / "out.parquet.jsonl"
    code = (
        "import sys, rigwatch\nfrom tests.batch.jobs import sizes\n"
        "from rigwatch.batch import executor_on\n"
        "if __name__ == '__main__':\n"
        "    with executor_on('local:2') as executor:\n"
        "        rigwatch.map(sizes, [sys.argv[1]], executor=executor, results=sys.argv[2],"
        " pause=0.05)"
    )
    script = tmp_path / "client.py"
    script.write_text(code)
    client = subprocess.Popen(
        [sys.executable, str(script), str(files), str(target)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    eventually(lambda: journal.exists() and journal.read_bytes().count(b"\n") >= 5, "some results")
    client.send_signal(signal.SIGKILL)
    client.wait()
    before = journal.read_bytes()
    assert 5 <= before.count(b"\n") < COUNT
    with journal.open("ab") as file:
        file.write(b'{"path":"torn')
    said: list[str] = []
    rigwatch.map(sizes, [files], results=target, pause=0.05, say=said.append)
    assert f"{_done(before)} of {COUNT} are done already" in said
    rigwatch.map(sizes, [files], results=tmp_path / f"whole.{ending}", pause=0.05)
    assert target.read_bytes() == (tmp_path / f"whole.{ending}").read_bytes()
    assert ending == "jsonl" or not journal.exists()


def _done(lines: bytes) -> int:
    return sum(b'"kind"' not in line for line in lines.splitlines())


def test_results_of_other_work_are_refused_and_kept(files, tmp_path):
    target = tmp_path / "out.jsonl"
    rigwatch.map(sizes, [files], results=target)
    before = target.read_bytes()
    with pytest.raises(BatchError, match="other settings"):
        rigwatch.map(sizes, [files], results=target, pause=0.001)
    foreign = tmp_path / "foreign.parquet"
    polars.DataFrame({"a": [1]}).write_parquet(foreign)
    with pytest.raises(BatchError, match="no table of results"):
        rigwatch.map(sizes, [files], results=foreign)
    assert target.read_bytes() == before


def test_a_setting_that_is_a_file_counts_with_its_content(tmp_path):
    from rigwatch.batch import job_of

    (tmp_path / "model.toml").write_text("a = 1")
    job = job_of(sizes)
    before = job.identity({"model": tmp_path / "model.toml"})
    (tmp_path / "model.toml").write_text("a = 2")
    assert job.identity({"model": tmp_path / "model.toml"}) != before
    with pytest.raises(BatchError, match=r"none\.toml: no such file"):
        job.identity({"model": tmp_path / "none.toml"})


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ("local:0", "expected local:N"),
        ("cloud", "expected local:4, dask://host:8786 or cluster.toml"),
        ("dask://127.0.0.1:1", "no scheduler of this version answers"),
    ],
)
def test_an_executor_that_is_not_there_is_reported_plainly(where, said, monkeypatch):
    monkeypatch.setattr("rigwatch.batch.dask_clients.CONNECT_S", 0.5)
    with pytest.raises(BatchError, match=said), executor_on(where):
        pass


def test_what_answers_and_is_no_scheduler_is_not_awaited_for_ever(monkeypatch):
    monkeypatch.setattr("rigwatch.batch.dask_clients.CONNECT_S", 0.2)
    monkeypatch.setattr("rigwatch.batch.dask_clients.ANSWER_S", 0.2)
    with ThreadingHTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler) as web:
        threading.Thread(target=web.serve_forever, daemon=True).start()
        where = f"dask://127.0.0.1:{web.server_port}"
        with pytest.raises(BatchError, match=f"{where}: .*no scheduler"), executor_on(where):
            pass
        web.shutdown()


class Kept(ThreadPoolExecutor):
    """Keeps what its workers answered."""

    def __init__(self) -> None:
        super().__init__(1)
        self.futures = []

    def submit(self, *call):
        self.futures.append(super().submit(*call))
        return self.futures[-1]


def test_dask_sends_the_outcomes_of_a_task_in_one_piece_however_many_they_are(files):
    from distributed.protocol import dumps, to_serialize

    with Kept() as executor:
        rigwatch.map(sizes, [files], executor=executor)
    answers = [future.result() for future in executor.futures]
    assert len(answers) < COUNT
    assert {len(dumps({"answer": to_serialize(answer)})) for answer in answers} == {
        len(dumps({"answer": to_serialize(b"any")}))
    }


def test_short_units_go_in_long_tasks_and_at_the_end_in_shorter_ones_that_are_worth_it():
    lengths, each_s = [], 0.002

    def run(paths, _label):
        lengths.append(len(paths))
        return pack([Outcome(path, "", b"1", seconds=each_s) for path in paths])

    units = [f"{number:05d}" for number in range(5000)]
    found = Drive(Pool(None), run, units, RETRIES, lambda _: None)
    assert [outcome.path for outcomes in found for outcome in outcomes] == units
    timed = lengths[2:]  # two begin before the time of a unit is known
    assert timed == sorted(timed, reverse=True)
    assert timed[0] == LARGEST_TASK
    assert all(size * each_s >= SHORTEST_TASK_S for size in timed[:-1])
    assert timed[-2] * each_s < 2 * SHORTEST_TASK_S

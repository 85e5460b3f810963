"""The same on a real Dask scheduler with workers that are killed."""

import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

import rigwatch
from rigwatch.batch import dask_clients, executor_on
from rigwatch.batch.dask_clients import QUIET, prologue
from rigwatch.commands import main
from rigwatch.wire.errors import BatchError, ConfigError, MissingExtraError
from tests.batch.cluster import Cluster
from tests.batch.jobs import ROOT, deadly, environment, make_files, sizes, version_or_death
from tests.waiting import eventually

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("dask")]
COUNT = 60
PAUSE = 0.05
CLIENT = """\
import sys, rigwatch
from rigwatch.batch import executor_on
from rigwatch.batch.dask_clients import QUIET, prologue
from tests.batch.jobs import sizes
with executor_on(sys.argv[3]) as executor:
    rigwatch.map(sizes, [sys.argv[1]], executor=executor, results=sys.argv[2], pause=0.05)
"""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with Cluster(tmp_path_factory.mktemp("dask"), 2, allowed_failures=1) as made:
        yield made


@pytest.fixture
def files(tmp_path: Path) -> Path:
    return make_files(tmp_path / "sessions", COUNT)


def _lines(file: Path) -> int:
    return file.read_bytes().count(b"\n") if file.exists() else 0


def test_killed_workers_and_a_killed_client_change_no_byte(cluster, files, tmp_path):
    target = tmp_path / "out.jsonl"
    client = subprocess.Popen(
        [sys.executable, "-c", CLIENT, str(files), str(target), cluster.address],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    eventually(lambda: _lines(target) >= 5, "some results")
    victim = cluster.workers()[0]
    victim.kill()
    eventually(lambda: _lines(target) >= 20 or client.poll() is not None, "more results")
    client.send_signal(signal.SIGKILL)
    client.wait()
    assert 5 <= _lines(target) < COUNT
    with executor_on(cluster.address) as executor:
        again = rigwatch.map(sizes, [files], executor=executor, results=target, pause=PAUSE)
    rigwatch.map(sizes, [files], results=tmp_path / "plain.jsonl", pause=PAUSE)
    assert again.failed == {}
    assert target.read_bytes() == (tmp_path / "plain.jsonl").read_bytes()


def test_a_worker_that_ends_while_it_is_asked_for_its_version_costs_nothing(
    cluster, files, tmp_path, monkeypatch
):
    mark = tmp_path / "died"
    monkeypatch.setattr(dask_clients, "_version", partial(version_or_death, str(mark)))
    with executor_on(cluster.address) as executor:
        assert mark.exists()
        assert rigwatch.map(sizes, [files], executor=executor).done == COUNT


def test_a_unit_that_kills_every_worker_is_named(cluster, files):
    with executor_on(cluster.address) as executor:
        found = rigwatch.map(deadly, [files], executor=executor, always="7")
    assert found.failed == {"WorkerDied": 1}
    assert [value for _, value in found] == [n for n in range(COUNT) if n != 7]


def test_a_command_runs_on_the_cluster(cluster, tmp_path, capsys):
    recordings = ROOT / "tests" / "verify"
    given = [str(recordings / f"{name}.mcap") for name in ("friction", "stiction")]
    words = ["replay", *given, "--model", str(recordings / "model.toml"), "--json"]
    assert main([*words, "--results", str(tmp_path / "here.jsonl")]) == 0
    assert main([*words, "--results", str(tmp_path / "dask.jsonl"), "--on", cluster.address]) == 0
    assert "dry_friction" in capsys.readouterr().out
    assert (tmp_path / "dask.jsonl").read_bytes() == (tmp_path / "here.jsonl").read_bytes()


def test_a_scheduler_of_another_version_is_one_sentence(cluster, monkeypatch, recwarn):
    from distributed import versions  # by the worker that uses it: every worker reads this file

    real = versions.version("distributed")
    of_this_process = versions.get_package_info
    monkeypatch.setattr(
        versions, "get_package_info", lambda names: of_this_process(names) | {"distributed": "1.2"}
    )
    with pytest.raises(BatchError) as told, executor_on(cluster.address):
        pass
    expected = f"the scheduler has Dask {real}, expected 1.2 as here"
    assert str(told.value) == f"{cluster.address}: {expected}"
    assert not recwarn.list


def test_a_cluster_declared_in_a_file_runs_its_workers_as_jobs(files, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    file = tmp_path / "cluster.toml"
    options = (
        f'cores = 1\nmemory = "1GB"\nlocal_directory = "{tmp_path}"\nlog_directory = "{tmp_path}"'
    )
    file.write_text(f'kind = "local"\njobs = 2\n[options]\n{options}\n')
    target = tmp_path / "jobs.jsonl"
    with executor_on(str(file)) as executor:
        assert rigwatch.map(sizes, [files], executor=executor, results=target).done == COUNT
        told = executor.submit(environment).result()
    assert QUIET.items() <= told.items()
    rigwatch.map(sizes, [files], results=tmp_path / "plain.jsonl")
    assert target.read_bytes() == (tmp_path / "plain.jsonl").read_bytes()


def test_the_lines_of_a_users_job_script_come_after_those_of_rigwatch():
    own = "export DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL=2s"
    first, second = prologue("slurm", {"job_script_prologue": [own]})
    assert first.startswith("export ")
    assert all(f"{name}={value}" in first.split() for name, value in QUIET.items())
    assert second == own
    assert prologue("slurm", {}) == [first]


def test_a_wrong_file_of_a_cluster_is_one_sentence(tmp_path, monkeypatch):
    file = tmp_path / "cluster.toml"
    file.write_text('kind = "abacus"')
    with pytest.raises(ConfigError, match="kind: found 'abacus'"), executor_on(str(file)):
        pass
    file.write_text('kind = "slurm"')
    with pytest.raises(BatchError, match=r"options: .*cores"), executor_on(str(file)):
        pass
    monkeypatch.setitem(sys.modules, "dask_jobqueue", None)
    with pytest.raises(MissingExtraError, match="rigwatch\\[dask\\]"), executor_on(str(file)):
        pass


@pytest.mark.nightly
def test_at_last_a_scheduler_that_goes_away_is_reported_and_results_are_kept(
    cluster, files, tmp_path
):
    target = tmp_path / "out.jsonl"
    seen: list[object] = []

    def gone(outcome: object) -> None:
        seen.append(outcome)
        if len(seen) == 5:
            cluster.end_scheduler()

    with (
        executor_on(cluster.address) as executor,
        pytest.raises(BatchError, match="scheduler is gone"),
    ):
        rigwatch.map(sizes, [files], executor=executor, results=target, pause=PAUSE, seen=gone)
    assert _lines(target) >= 5
    assert rigwatch.map(sizes, [files], results=target, pause=PAUSE).done == COUNT

"""Commands over several recordings and studies."""

import json
import shutil
from pathlib import Path

import polars
import pytest

from rigwatch.commands import main
from tests.batch.jobs import ROOT
from tests.report.drive import make_study

VERIFY = ROOT / "tests" / "verify"
MODEL = ["--model", str(VERIFY / "model.toml")]


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    folder = tmp_path / "sessions"
    (folder / "deep").mkdir(parents=True)
    shutil.copy(VERIFY / "friction.mcap", folder / "deep" / "friction.mcap")
    shutil.copy(VERIFY / "stiction.mcap", folder / "deep" / "stiction.mcap")
    return folder


def test_a_line_for_each_recording_and_the_same_alarms_as_alone(recordings, capsys):
    assert main(["replay", str(recordings), *MODEL, "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [Path(line["path"]).stem for line in lines] == ["friction", "stiction"]
    for line in lines:
        assert main(["replay", line["path"], *MODEL, "--json"]) == 0
        alone = json.loads(capsys.readouterr().out)
        for name in ("samples", "duration_s", "alarms", "events", "lost"):
            assert line["result"][name] == alone[name]


def test_a_bad_recording_is_named_and_the_others_are_done(recordings, capsys):
    (recordings / "bad.mcap").write_bytes(b"nonsense")
    pattern = str(recordings / "**" / "*.mcap")
    assert main(["replay", pattern, *MODEL, "--on", "local:2"]) == 1
    out, err = capsys.readouterr()
    assert "friction.mcap: 2048 samples, 8.0 s; alarms raised: " in out
    assert "dry_friction" in out
    assert f"failed: {recordings}/bad.mcap: holds no message of rigwatch" in err
    assert "2 done, 1 failed: 1 SessionError" in err


def test_a_folder_that_is_a_session_remains_one(recordings, capsys):
    assert main(["replay", str(recordings / "deep"), *MODEL, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["samples"] > 2048


def test_what_only_one_recording_can_have_is_refused(recordings, capsys):
    assert main(["replay", str(recordings), *MODEL, "--out", "new.mcap"]) == 2
    assert "--out: found several recordings, expected one" in capsys.readouterr().err
    assert main(["replay", str(recordings), *MODEL, "--results", "new.txt"]) == 2
    assert "expected .jsonl or .parquet" in capsys.readouterr().err


@pytest.mark.nightly  # two explanations by the whole library; other jobs' bits are compared by day
def test_studies_give_the_same_bits_alone_and_in_processes(tmp_path, capsys):
    made = make_study(tmp_path / "studies" / "one")
    (tmp_path / "studies" / "broken").mkdir()
    (tmp_path / "studies" / "broken" / "study.toml").write_text("model = 3")
    target = tmp_path / "verdicts.jsonl"
    words = ["--results", str(target), "--on", "local:2"]
    assert main(["explain", str(tmp_path / "studies"), *words]) == 1
    out, err = capsys.readouterr()
    assert "missing_effect: " in out
    assert "broken/study.toml" in err
    assert "1 done, 1 failed: 1 ConfigError" in err
    assert main(["explain", str(made.folder), "--json"]) == 0
    alone = json.loads(capsys.readouterr().out)
    broken, whole = (json.loads(line) for line in target.read_bytes().splitlines())
    assert broken["kind"] == "ConfigError"
    assert whole["path"] == str(made.folder)
    assert whole["value"] == alone


def test_errors_of_a_study_as_a_line_of_results(tmp_path, capsys):
    made = make_study(tmp_path / "studies")
    target = tmp_path / "errors.parquet"
    assert main(["compare", str(made.folder), "--results", str(target)]) == 0
    assert "N, noise floor " in capsys.readouterr().out
    (row,) = polars.read_parquet(target).to_dicts()
    assert row["held_out_error"] > row["noise_floor"] > 0


def test_cases_of_several_rigs_are_verified_and_one_that_differs_is_named(tmp_path, capsys):
    one = '[[case]]\nname = "friction"\nrecording = "friction.mcap"\nmodel = "model.toml"\n'
    for rig, reference in (("a", "friction.reference.mcap"), ("b", "none.mcap")):
        (tmp_path / rig).mkdir()
        for name in ("friction.mcap", "friction.reference.mcap", "model.toml"):
            shutil.copy(VERIFY / name, tmp_path / rig / name)
        (tmp_path / rig / "cases.toml").write_text(f'{one}reference = "{reference}"\n')
    assert main(["verify", str(tmp_path), "--json"]) == 1
    out, err = capsys.readouterr()
    good, bad = (json.loads(line) for line in out.splitlines())
    (said,) = good["result"]
    assert said.startswith("friction: 2048 samples of ")
    assert said.endswith("as in the reference")
    assert "there is no reference yet" in bad["error"]
    assert f"failed: {tmp_path}/b/cases.toml: friction: " in err

"""JSON that is not what was expected: one kind of error, whoever reads it."""

from pathlib import Path
from typing import Any

import pytest

from monitor.model.model_versions import history
from rigwatch.batch.journal import Journal
from rigwatch.recorder.positions import FILE, load_positions
from rigwatch.wire.access.register import Register
from rigwatch.wire.errors import BatchError
from rigwatch.wire.typed_files import JsonError, json_value
from rigwatch.workbench.study.folder import FILE as STUDY
from rigwatch.workbench.study.folder import LEDGER, NEW, settle

WRONG = {
    "torn": b'{"step": "ad',
    "not UTF-8": b'{"step": "\xff\xfe"}',
    "nested": b"[" * 100_000,
    "of another type": b"5",
    "empty": b"",
}


@pytest.fixture(params=WRONG.values(), ids=[name.replace(" ", "-") for name in WRONG])
def wrong(request: pytest.FixtureRequest) -> bytes:
    return bytes(request.param)


@pytest.mark.parametrize("kind", [dict[str, Any], Register, tuple[int, ...]])
def test_whatever_is_wrong_is_one_error(wrong: bytes, kind: Any) -> None:
    with pytest.raises(JsonError):
        json_value(wrong, kind)


def test_a_studys_folder_settles_behind_such_a_line(wrong: bytes, tmp_path: Path) -> None:
    (tmp_path / STUDY).write_text("as it was")
    (tmp_path / NEW).write_text("a change without its line")
    (tmp_path / LEDGER).write_bytes(wrong + b"\n")
    settle(tmp_path)
    assert (tmp_path / STUDY).read_text() == "as it was"
    assert not (tmp_path / NEW).exists()


def test_a_journal_of_results_with_such_a_line_is_refused_by_name(
    wrong: bytes, tmp_path: Path
) -> None:
    file = tmp_path / "results.jsonl"
    file.write_bytes(wrong + b"\n")
    with pytest.raises(BatchError, match=r"results\.jsonl: holds a line that is no result"):
        Journal(file, "work")


def test_models_and_positions_are_read_as_if_it_were_not_there(
    wrong: bytes, tmp_path: Path
) -> None:
    (tmp_path / "model.history.jsonl").write_bytes(wrong + b"\n")
    (tmp_path / FILE).write_bytes(wrong)
    assert history(tmp_path / "model.toml") == []
    assert load_positions(tmp_path) == {}

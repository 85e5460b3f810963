"""Locked packages against a database of vulnerabilities in OSV's format."""

import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from tools.supply_chain.licences import locked
from tools.supply_chain.vulnerabilities import is_affected, main, read_database

EVENTS: dict[str, tuple[list[dict[str, str]], dict[str, bool]]] = {
    "all before a fix": (
        [{"introduced": "0"}, {"fixed": "1.10"}],
        {"1.9": True, "1.10": False, "1.10rc1": True, "2.0": False},
    ),
    "never fixed": ([{"introduced": "1.5"}], {"1.4": False, "1.5": True, "9": True}),
    "the last one is affected": (
        [{"introduced": "1"}, {"last_affected": "1.2"}],
        {"1.2": True, "1.2.1": False},
    ),
    "two spans": (
        [{"introduced": "3"}, {"fixed": "3.2"}, {"introduced": "1"}, {"fixed": "1.9"}],
        {"1.8": True, "2": False, "3.1": True, "3.2": False},
    ),
}


def record(name: str, **affected: Any) -> dict[str, Any]:
    package = {"ecosystem": "PyPI", "name": name}
    return {
        "id": f"TEST-{name}",
        "modified": "2026-01-02T03:04:05Z",
        "summary": "a test",
        "affected": [{"package": package, **affected}],
    }


def stored(folder: Path, *records: dict[str, Any]) -> Path:
    path = folder / "all.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for one in records:
            archive.writestr(f"{one['id']}.json", json.dumps(one))
    return path


@pytest.mark.parametrize("name", EVENTS)
def test_a_range_affects_the_versions_within_it(name: str) -> None:
    events, expected = EVENTS[name]
    affected = {"ranges": [{"type": "ECOSYSTEM", "events": events}]}
    assert {version: is_affected(version, affected) for version in expected} == expected


def test_a_locked_version_that_is_affected_is_found_by_any_spelling(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (package,) = (one for one in locked("lock") if one.name == "typing-extensions")
    path = stored(
        tmp_path, record("Typing_Extensions", versions=[package.version]), record("no-such-one")
    )
    assert main([str(path)]) == 1
    assert f"{package.name} {package.version}: TEST-Typing_Extensions" in capsys.readouterr().out


def test_what_is_withdrawn_fixed_or_of_others_affects_nobody(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (package,) = (one for one in locked("lock") if one.name == "numpy")
    events = [{"introduced": "0"}, {"fixed": package.version}]
    fixed = record("numpy", ranges=[{"type": "ECOSYSTEM", "events": events}])
    withdrawn = record("scipy", versions=[one.version for one in locked("lock")])
    other = record("pillow", versions=[one.version for one in locked("lock")])
    other["affected"][0]["package"]["ecosystem"] = "npm"
    path = stored(tmp_path, fixed, withdrawn | {"withdrawn": "2026-01-01T00:00:00Z"}, other)
    assert main([str(path), "--sha256", read_database(path).sha256]) == 0
    assert "0 known vulnerabilities; database of 2026-01-02" in capsys.readouterr().out


def test_a_copy_that_is_another_or_none_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = stored(tmp_path, record("numpy", versions=[]))
    (tmp_path / "text.zip").write_text("text")
    (tmp_path / "empty").mkdir()
    assert main([str(path), "--sha256", "0" * 64]) == 2
    assert main([str(tmp_path / "text.zip")]) == 2
    assert main([str(stored(tmp_path / "empty"))]) == 2
    assert capsys.readouterr().out == ""

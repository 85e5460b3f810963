"""The viewer's process: on this machine only, silent towards the network, plain about trouble."""

import importlib.util
import json
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from rigwatch.commands import main
from rigwatch.dashboard.viewer.opening import open_viewer
from rigwatch.dashboard.viewer.viewer import Viewer, ViewerError, answers
from rigwatch.wire.host.ports import free_port
from rigwatch.wire.rig_config import DashboardSection
from tests.waiting import eventually


@pytest.fixture
def homes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A person who has not opted out of usage reports; returns the folder reports are kept in."""
    reports = tmp_path / "reports"
    config = tmp_path / "config" / "rerun" / "analytics.json"
    config.parent.mkdir(parents=True)
    settings = {
        "analytics_enabled": True,
        "analytics_id": "0",
        "metadata": {},
        "config_file_path": str(config),
        "data_dir_path": str(reports),
    }
    config.write_text(json.dumps(settings))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.delenv("CI", raising=False)
    return reports


@pytest.fixture
def web(homes: Path) -> Iterator[Viewer]:
    viewer = Viewer("web").await_answer()
    yield viewer
    viewer.stop()


def test_web_viewer_is_served_on_this_machine_only(web: Viewer) -> None:
    eventually(lambda: answers(web.web_port), "the page is served")
    with urllib.request.urlopen(web.web_url, timeout=10) as page:
        assert b"<html" in page.read()
        assert page.url.endswith(f"/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A{web.port}%2Fproxy")
        rule = page.headers["Content-Security-Policy"]
    assert f"connect-src 'self' data: blob: http://127.0.0.1:{web.port}" in rule
    assert "https:" not in rule
    assert "*" not in rule
    process = psutil.Process(web.pid)
    everyone = [process, psutil.Process()]
    places = [c.laddr for one in everyone for c in one.net_connections() if c.status == "LISTEN"]
    assert {place.port for place in places} >= {web.port, web.web_port}
    assert {place.ip for place in places} == {"127.0.0.1"}


def test_what_the_viewer_does_not_have_is_not_there(web: Viewer) -> None:
    with pytest.raises(urllib.error.HTTPError, match="404"):
        urllib.request.urlopen(f"http://127.0.0.1:{web.web_port}/nothing", timeout=10)


def test_no_usage_report_is_kept_or_sent(web: Viewer, homes: Path) -> None:
    eventually(lambda: answers(web.web_port), "the page is served")
    web.stop()  # what it would keep, it has kept when it has ended
    assert not homes.exists()


def test_a_taken_port_is_reported(web: Viewer) -> None:
    with pytest.raises(ViewerError, match=f"port {web.port} is taken"):
        Viewer("web", port=web.port)


def test_a_viewer_that_cannot_start_gives_the_reason() -> None:
    viewer = Viewer("headless")
    viewer._process.kill()
    with pytest.raises(ViewerError, match="the viewer did not start"):
        viewer.await_answer()


def test_waiting_for_somebody_elses_viewer_can_be_given_up() -> None:
    remarks: list[str] = []
    stop = threading.Event()
    settings = DashboardSection(grpc_port=free_port())
    found = open_viewer("connect", settings, stop, remarks.append, stop.set)
    assert found is None
    assert f"waiting for a viewer at port {settings.grpc_port}" in remarks[0]


def test_without_rerun_there_is_one_plain_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda *_: None)
    assert main(["view", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("rigwatch: the dashboard needs the package rerun-sdk")
    assert said.count("\n") == 1

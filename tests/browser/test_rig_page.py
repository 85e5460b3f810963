"""The rig's page: why the monitor does not watch, and the history of promotions."""

from pathlib import Path

from rigwatch.browser.rig.live_view import LiveView
from rigwatch.browser.rig.promotions import can_roll_back, promotions
from rigwatch.wire.messages.message_types import Health
from tests.workbench.rigs.test_rig_story import Shell


def test_why_the_monitor_does_not_watch() -> None:
    live = LiveView(256.0)
    assert "no samples arrive" in live.states(0.0, 3.0)["why"]
    live.take(Health("monitor", 0, "unsuitable", "the model needs a channel", {}), 0.0)
    live._heard["samples"] = 0.0
    assert live.states(1.0, 3.0)["why"] == "the model needs a channel"
    live.take(Health("monitor", 0, "running", "", {}), 1.0)
    assert "no monitor runs" in live.states(1.0, 3.0)["why"]
    live._heard["estimates"], live._figures = 1.0, {"armed": 0.0}
    assert "about 3 s of steady drive" in live.states(1.0, 3.0)["why"]
    live._figures = {"armed": 1.0, "observable": 1.0}
    assert live.states(1.0, 3.0)["armed"]
    assert live.states(1.0, 3.0)["why"] == ""
    assert live.states(9.0, 3.0)["processes"][0]["state"] == "silent"


def test_a_rig_without_promotions_has_an_empty_history(tmp_path: Path) -> None:
    shell = Shell(tmp_path)
    assert promotions(shell.config, tmp_path) == []
    assert not can_roll_back(shell.config)

"""Rigs of one process share a link: each leaves it alone, and the memory of rings is divided."""

from pathlib import Path

from rigwatch.wire.bus import SharedLinks, connect
from rigwatch.wire.messages import EVENTS, Event
from rigwatch.wire.rig_config import load_rig
from tests.bus.rig import TestRig
from tests.monitor_process.test_several import rig_file
from tests.waiting import PATIENCE, eventually


def test_a_rig_that_leaves_takes_back_what_is_its_own_and_nothing_else(tmp_path: Path) -> None:
    with TestRig(tmp_path) as base:
        base.router()
        configs = [load_rig(rig_file(tmp_path, name, base.listen)) for name in ("a", "b")]
        links = SharedLinks(2)
        left, right = (connect(config, "daq", PATIENCE, links) for config in configs)
        assert left.identity == right.identity
        outside = [connect(config, "observer", PATIENCE) for config in configs]
        heard = [bus.subscribe(EVENTS) for bus in outside]
        eventually(lambda: "alive/daq" in outside[0].tokens("alive/*"), "the token")
        left.close()
        eventually(lambda: "alive/daq" not in outside[0].tokens("alive/*"), "the token's end")
        assert "alive/daq" in outside[1].tokens("alive/*")
        right.publish(EVENTS, Event("daq", 1, "info", "CODE", "still here"))
        assert heard[1].get(timeout=PATIENCE).text == "still here"
        assert len(heard[0]) == 0
        for bus in (*outside, right):
            bus.close()
        links.close()


def test_rings_of_many_rigs_take_no_more_than_is_left_for_each() -> None:
    assert SharedLinks(2).ring_megabytes == 32.0
    assert SharedLinks(300).ring_megabytes == 4.0

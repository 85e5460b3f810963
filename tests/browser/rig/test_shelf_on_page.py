"""The shelf on the rig's page: what is kept quiet, until when and by whom. A real router."""

import time
from pathlib import Path

import pytest

from monitor.alarms import AlarmManager, Occasion
from monitor.process.operator_desk import shelf_of
from rigwatch.wire.bus import serve_alarm_list, serve_shelf
from rigwatch.wire.messages import AlarmCommand
from tests.browser.page import browser, looking, serving
from tests.bus.rig import TestRig
from tests.monitor_process.model import monitor_section

pytestmark = pytest.mark.xdist_group("browser")
SHELVED = '[data-shelved="loss"]'


def test_the_page_tells_what_is_shelved_until_it_is_taken_off(tmp_path: Path) -> None:
    alarms = AlarmManager()
    alarms.report("loss", Occasion("rig", 7, 0, time.time_ns()), active=True)
    folder = tmp_path / "studies"
    folder.mkdir()
    with TestRig(tmp_path, monitor_section(tmp_path)) as rig:
        rig.router()
        monitor = rig.bus("monitor")
        monitor.announce()
        serve_alarm_list(monitor, alarms.standing)
        serve_shelf(monitor, lambda: shelf_of(alarms))
        with (
            serving(folder, "--rig", str(rig.path), cwd=tmp_path) as served,
            browser() as driver,
            looking(driver, served) as page,
        ):
            page.open("/rig")
            page.until(lambda: page.all('[data-alarm="loss"]'), "the alarm stands")
            assert page.all(SHELVED) == []
            for action in ("shelve", "unshelve"):
                order = AlarmCommand("loss", action, "ann", time.time_ns(), "cable on order")
                alarms.command(order, "proved")
                shown = action == "shelve"
                page.until(lambda s=shown: bool(page.all(SHELVED)) is s, action)
                if shown:
                    told = page.text(SHELVED)
                    assert told.startswith("loss until ")
                    assert told.endswith("by ann (proved); its condition holds: cable on order")

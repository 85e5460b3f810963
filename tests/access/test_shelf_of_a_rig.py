"""What is on the shelf of a rig with keys, told by `rigwatch alarms`: a real monitor and router."""

import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rigwatch.wire.bus import Bus, ask_alarm_list, ask_shelf
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import HEALTH, Health
from tests.access.secured_rig import SecuredRig, make_keys
from tests.bus.rig import kill, rigwatch
from tests.monitor_process.model import monitor_section
from tests.waiting import eventually

NAME, SHORT = "disk", {"disk_trouble": 1.0}


def standing(bus: Bus) -> set[str]:
    try:
        return {alarm.name for alarm in ask_alarm_list(bus)}
    except BusError:
        return set()


def shelf(bus: Bus) -> set[str]:
    """Shelved alarms whose condition holds."""
    try:
        return {alarm.name for alarm in ask_shelf(bus) if alarm.active}
    except BusError:
        return set()


@contextmanager
def short_of_space(recorder: Bus) -> Iterator[None]:
    """The recorder tells so all the time: an alarm whose condition nobody tells ends by itself."""
    stop = threading.Event()

    def tell() -> None:
        while not stop.wait(0.2):
            health = Health("recorder", time.time_ns(), "running", "9 % free", SHORT)
            recorder.publish(HEALTH, health)

    told = threading.Thread(target=tell)
    told.start()
    try:
        yield
    finally:
        stop.set()
        told.join()


def test_a_shelved_alarm_is_listed_with_its_operator_also_after_a_kill(tmp_path: Path) -> None:
    with SecuredRig(tmp_path, make_keys(tmp_path / "keys"), monitor_section(tmp_path)) as rig:
        rig.router()
        monitor = rig.start("-m", "rigwatch", "monitor", str(rig.path))
        path, ann = str(rig.path), rig.bus("ack-ann")
        with short_of_space(rig.bus("recorder")):
            eventually(lambda: NAME in standing(ann), "the alarm")
            done = rigwatch("ack", path, NAME, "--shelve", "--text", "disk on order")
            assert f"{NAME} shelved by ann for 8 h: disk on order" in done.stdout
            assert NAME not in standing(ann)

            kill(monitor)
            eventually(lambda: "alive/monitor" not in ann.tokens("alive/*"), "its end")
            done = rigwatch("alarms", path, "--shelved")
            assert (done.returncode, done.stdout) == (2, "")
            assert "no monitor of rig" in done.stderr

            rig.start("-m", "rigwatch", "monitor", path)
            eventually(lambda: NAME in shelf(ann), "its condition on the shelf")
            (one,) = json.loads(rigwatch("alarms", path, "--shelved", "--json").stdout)
            told = one["name"], one["user"], one["identity"], one["text"], one["active"]
            assert told == (NAME, "ann", "proved", "disk on order", True)
            assert 7.9 * 3600 < one["until_ns"] * 1e-9 - time.time() <= 8 * 3600
            line = f"by ann (proved): {NAME}, its condition holds: disk on order"
            assert line in rigwatch("alarms", path).stdout

            said = rigwatch("ack", path, NAME, "--unshelve").stdout
            assert f"{NAME} taken off the shelf: ann" in said
            assert rigwatch("alarms", path, "--shelved").stdout == "no shelved alarms\n"
            assert NAME in standing(ann)

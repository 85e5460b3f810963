"""On a rig with keys, commands act only in the name of the operator who signs them."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.keys import Authority
from rigwatch.wire.bus import (
    Bus,
    ModelRequest,
    ask_alarm_list,
    ask_for_model,
    command_alarms,
)
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import COMMANDS, ESTIMATES, EVENTS, HEALTH, Alarm, AlarmCommand
from tests.access.secured_rig import SecuredRig, make_keys
from tests.bus.rig import kill, rigwatch
from tests.monitor_process.model import monitor_section
from tests.waiting import PATIENCE, eventually

pytestmark = pytest.mark.long


def reset_by(bus: Bus) -> list[Alarm]:
    """Alarms that a reset by ann changes; the router or the monitor may be who refuses it."""
    try:
        return command_alarms(bus, AlarmCommand("*", "reset", "ann", 1)).changed
    except BusError:
        return []


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[SecuredRig]:
    keys = make_keys(tmp_path / "keys")
    section = monitor_section(tmp_path) + "\n[witness]\n"
    with SecuredRig(tmp_path, keys, section) as made:
        made.router()
        yield made


def standing(bus: Bus) -> dict[str, str]:
    try:
        return {alarm.name: alarm.state for alarm in ask_alarm_list(bus)}
    except BusError:
        return {}


def journal(rig: SecuredRig) -> list[tuple[str, str, str]]:
    lines = (rig.folder / "alarms.jsonl").read_text().splitlines()
    alarms = [json.loads(line)["alarm"] for line in lines]
    return [(a["name"], a["user"], a["identity"]) for a in alarms if a["user"]]


def refusal(bus: Bus, command: AlarmCommand) -> str:
    """Publish a command as it is; the event that refuses it."""
    events = bus.subscribe(EVENTS)
    bus.publish(COMMANDS, command)
    said: list[str] = []

    def refused() -> bool:
        said.extend(e.text for e in events.drain() if e.code == "alarm_command_refused")
        return bool(said)

    eventually(refused, "the refusal")
    events.close()
    return said[0]


@pytest.mark.nightly
def test_an_operator_acts_in_the_own_name_only_and_a_revoked_one_not_at_all(
    rig: SecuredRig,
) -> None:
    monitor = rig.start("-m", "rigwatch", "monitor", str(rig.path))
    rig.start("-m", "rigwatch", "witness", str(rig.path))
    publisher = rig.publisher(5, "--wave")
    ann = rig.bus("ack-ann")
    judged = ann.subscribe(ESTIMATES)
    eventually(lambda: "alive/witness" in ann.tokens("alive/*"), "the witness")
    eventually(lambda: bool(judged.drain()), "the monitor")
    recorded = rig.bus("recorder").subscribe(COMMANDS)
    kill(publisher)
    eventually(lambda: {"stale", "monitor_stale"} <= set(standing(ann)), "the alarms")

    answer = command_alarms(ann, AlarmCommand("monitor_stale", "acknowledge", "bob", 1))
    assert not answer.changed
    assert "it is signed by ann, expected bob" in answer.refusal
    answer = command_alarms(ann, AlarmCommand("monitor_stale", "acknowledge", "ann", 1))
    (seen,) = answer.changed
    assert (seen.state, seen.user, seen.identity) == ("acknowledged", "ann", "proved")

    recorded.drain()
    done = rigwatch("ack", str(rig.path), "--json")
    assert done.returncode == 0, done.stderr
    changed = json.loads(done.stdout)["changed"]
    assert {(a["user"], a["identity"]) for a in changed} == {("ann", "proved")}
    eventually(lambda: ("ann", "proved") in {entry[1:] for entry in journal(rig)}, "the journal")
    done = rigwatch("ack", str(rig.path), "--user", "bob")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "user: found bob, expected ann" in done.stderr

    # The command line could be changed: the monitor verifies.
    genuine: AlarmCommand = recorded.get(timeout=PATIENCE)
    why = command_alarms(ann, AlarmCommand("*", "acknowledge", "bob", 1)).refusal
    assert "it is signed by ann, expected bob" in why
    assert "it is not signed" in refusal(ann, AlarmCommand("*", "reset", "ann", 1))
    assert "it was received before" in refusal(ann, genuine)
    reply = ask_for_model(ann, ModelRequest("rollback", "", "bob", ""))
    assert "it is signed by ann, expected bob" in reply.text
    # Verified, then refused for another reason: there is nothing to roll back to.
    assert "no version before" in ask_for_model(ann, ModelRequest("rollback", "", "ann", "")).text

    kill(monitor)
    eventually(lambda: "alive/monitor" not in ann.tokens("alive/*"), "its end")
    rig.start("-m", "rigwatch", "monitor", str(rig.path))
    eventually(lambda: "alive/monitor" in ann.tokens("alive/*"), "the monitor again")
    eventually(lambda: "stale" in standing(ann), "its list")
    assert "it is signed for another run" in refusal(ann, genuine)

    bob = rig.bus("ack-bob", rig.of("bob"))
    healths = bob.subscribe(HEALTH)
    Authority(rig.keys).revoke("ann")
    assert reset_by(ann) == []
    eventually(
        lambda: any(h.counters.get("register_reloads") for h in healths.drain()),
        "the router has opened anew",
    )
    assert reset_by(ann) == []
    why = command_alarms(bob, AlarmCommand("nothing", "reset", "bob", 1)).refusal
    assert "no such alarm" in why
    assert {entry[1:] for entry in journal(rig)} == {("ann", "proved")}

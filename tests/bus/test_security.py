"""With keys only a rig's own processes are heard, each in its role; without, loopback only."""

import stat
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.keys import Authority
from rigwatch.wire.access import ROLES, ending_soon, read_register
from rigwatch.wire.bus import DEVICE_KEY, DEVICE_RUN_KEY, Bus, connect, open_router
from rigwatch.wire.errors import BusError, ConfigError, KeysError
from rigwatch.wire.messages import (
    ALARMS,
    COMMANDS,
    EVENTS,
    GAPS,
    HEALTH,
    AlarmCommand,
    Event,
    Gap,
    Health,
    encode,
)
from rigwatch.wire.rig_config import RigConfig, load_rig
from tests.bus.rig import TestRig
from tests.bus.test_complete_subscription import alarm, heard, say
from tests.waiting import PATIENCE, eventually, wait_until


def config_with(
    folder: Path, keys: Path | None, listen: str = "127.0.0.1", more: str = ""
) -> RigConfig:
    rig = TestRig(folder)
    text = rig.path.read_text()
    if keys:
        more += f'keys = "{keys}"\n'
        text = text.replace("tcp/", "tls/")
    text = text.replace("/127.0.0.1", f"/{listen}")
    rig.path.write_text(text.replace("[[channels]]", f"[bus.security]\n{more}[[channels]]", 1))
    return load_rig(rig.path)


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("keys") / "keys"
    authority = Authority.create(folder, "bench")
    for role in ROLES:
        authority.issue(role, role)
    authority.issue("ann", "operator")
    authority.revoke("ann")
    return folder


@pytest.fixture
def secured(tmp_path: Path, keys: Path) -> Iterator[RigConfig]:
    config = config_with(tmp_path, keys)
    close = open_router(config)
    yield config
    close()


def until_reached(sender: Bus, receiver: Bus) -> None:
    """Both know of each other."""
    events = receiver.subscribe(EVENTS)

    def reached() -> bool:
        sender.publish(EVENTS, Event("test", 1, "info", "TEST", ""))
        return events.get(timeout=0.05) is not None

    eventually(reached, "an event arrives")
    events.close()


def test_each_role_says_what_is_its_own_and_nothing_else(secured: RigConfig) -> None:
    names = ("monitor", "alarms-1", "recorder", "dashboard", "daq")
    monitor, operator, recorder, dashboard, daq = (connect(secured, n, PATIENCE) for n in names)
    try:
        alarms, commands = recorder.subscribe(ALARMS), monitor.subscribe(COMMANDS)
        until_reached(monitor, recorder)
        until_reached(operator, monitor)
        say(monitor, range(1))
        assert heard(alarms, 0) == [0]
        received = recorder.subscribe_lossy(ALARMS)
        for stranger in (operator, dashboard, daq):
            until_reached(stranger, monitor)
            stranger.transport.put(stranger.key(ALARMS.key), encode(alarm(666)))
        for stranger in (dashboard, daq, recorder):
            stranger.publish(COMMANDS, AlarmCommand("*", "acknowledge", "nobody", 1))
        operator.publish(COMMANDS, AlarmCommand("*", "acknowledge", "ann", 1))
        assert commands.get(timeout=PATIENCE).user == "ann"
        say(monitor, range(1, 2))
        assert heard(alarms, 1) == [1]
        assert received.get(timeout=PATIENCE).seq == 1
        assert received.drain() == []
        assert commands.drain() == []
    finally:
        for bus in (monitor, operator, recorder, dashboard, daq):
            bus.close()


def test_only_daq_and_recorder_say_how_they_are(secured: RigConfig) -> None:
    names = ("monitor", "daq", "recorder", "dashboard")
    monitor, daq, recorder, dashboard = (connect(secured, name, PATIENCE) for name in names)
    try:
        own = {name: monitor.subscribe_own(HEALTH, name) for name in HEALTH.owned_by}
        for bus in (daq, recorder, dashboard):
            until_reached(bus, monitor)
        forged = encode(Health("recorder", 1, "stopped", "", {}))
        for stranger, victim in ((dashboard, "recorder"), (daq, "recorder"), (recorder, "daq")):
            stranger.transport.put(stranger.key(HEALTH.key_of(victim)), forged)
            until_reached(stranger, monitor)
        for bus in (daq, recorder):
            bus.publish(HEALTH, Health(bus.process, 1, "running", "", {}))
            assert own[bus.process].get(timeout=PATIENCE).source == bus.process
            assert own[bus.process].drain() == []
    finally:
        for bus in (monitor, daq, recorder, dashboard):
            bus.close()


def test_only_the_recorder_reports_its_losses(secured: RigConfig) -> None:
    names = ("monitor", "recorder", "dashboard", "daq")
    reader, recorder, *strangers = (connect(secured, name, PATIENCE) for name in names)
    try:
        reports = reader.subscribe_own(GAPS, "recorder")
        for stranger in strangers:
            until_reached(stranger, reader)
            forged = encode(Gap("rig", 7, 0, 9, 1, "recorder", "lost"))
            stranger.transport.put(stranger.key(GAPS.key_of("recorder")), forged)
            until_reached(stranger, reader)
        recorder.publish(GAPS, Gap("rig", 7, 5, 5, 1, "recorder", "lost"))
        assert reports.get(timeout=PATIENCE).first == 5
        assert reports.drain() == []
    finally:
        for bus in (reader, recorder, *strangers):
            bus.close()


def test_only_daq_answers_for_its_device_and_only_operators_ask(secured: RigConfig) -> None:
    names = ("daq", "dashboard", "recorder", "accept-1")
    daq, dashboard, recorder, operator = (connect(secured, name, PATIENCE) for name in names)
    try:
        for key in (DEVICE_KEY, DEVICE_RUN_KEY):
            dashboard.serve(key, lambda _: [b"dashboard"])
            until_reached(dashboard, operator)
            daq.serve(key, lambda _: [b"daq"])
            eventually(lambda k=key: b"daq" in operator.query(k), "daq answers")  # type: ignore[misc]
            assert operator.query(key) == [b"daq"]
            assert recorder.query(key, timeout=0.5) == []
    finally:
        for bus in (daq, dashboard, recorder, operator):
            bus.close()


def test_nobody_feigns_the_presence_of_daq_or_recorder(secured: RigConfig) -> None:
    monitor, dashboard = (connect(secured, name, PATIENCE) for name in ("monitor", "dashboard"))
    try:
        for name in (*HEALTH.owned_by, "second-screen"):
            dashboard.declare_token(f"alive/{name}")
        eventually(lambda: "alive/second-screen" in monitor.tokens("alive/*"), "its own token")
        assert not {"alive/daq", "alive/recorder"} & set(monitor.tokens("alive/*"))
    finally:
        for bus in (monitor, dashboard):
            bus.close()


def test_one_without_a_certificate_of_this_authority_is_not_let_in(
    secured: RigConfig, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    authority = Authority.create(other, "bench")
    authority.issue("monitor", "monitor")
    text = (tmp_path / "rig.toml").read_text()
    (tmp_path / "other.toml").write_text(text.replace(secured.bus.security.keys, str(other)))
    with pytest.raises(BusError, match="no router answers"):
        connect(load_rig(tmp_path / "other.toml"), "monitor", 0.5)
    head, rest = text.replace("tls/", "tcp/").split("[bus.security]")
    without_keys = head + rest[rest.index("[[channels]]") :]
    (tmp_path / "plain.toml").write_text(without_keys)
    with pytest.raises(BusError, match="no router answers"):
        connect(load_rig(tmp_path / "plain.toml"), "monitor", 0.5)


def test_a_revoked_certificate_cannot_send(secured: RigConfig, tmp_path: Path) -> None:
    text = (tmp_path / "rig.toml").read_text()
    (tmp_path / "ann.toml").write_text(
        text.replace("[bus.security]", '[bus.security]\noperator = "ann"')
    )
    monitor, valid = (connect(secured, name, PATIENCE) for name in ("monitor", "ack-1"))
    revoked = connect(load_rig(tmp_path / "ann.toml"), "ack-2", PATIENCE)
    commands = monitor.subscribe(COMMANDS)
    until_reached(valid, monitor)
    revoked.publish(COMMANDS, AlarmCommand("*", "acknowledge", "ann", 1))
    valid.publish(COMMANDS, AlarmCommand("*", "acknowledge", "bob", 1))
    assert wait_until(lambda: len(commands) > 0, PATIENCE)
    assert [command.user for command in commands.drain()] == ["bob"]
    for bus in (monitor, valid, revoked):
        bus.close()


def test_beyond_loopback_a_router_asks_for_keys(tmp_path: Path, keys: Path) -> None:
    with pytest.raises(ConfigError, match=r"without keys, expected a loopback address, or keys"):
        open_router(config_with(tmp_path, None, "0.0.0.0"))
    open_router(config_with(tmp_path, None, "0.0.0.0", "isolated_network = true\n"))()
    open_router(config_with(tmp_path, keys, "0.0.0.0"))()
    plain = config_with(tmp_path, None, more=f'keys = "{keys}"\n')
    with pytest.raises(ConfigError, match=r"expected tls/"):
        open_router(plain)


def test_missing_keys_are_reported_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(KeysError, match=r"router\.pem|authority\.pem"):
        open_router(config_with(tmp_path, tmp_path / "nowhere"))


def test_the_command_makes_issues_revokes_and_shows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "keys"
    assert main(["keys", "show", str(folder)]) == 2
    assert f"make one with `rigwatch keys new {folder}`" in capsys.readouterr().err
    assert main(["keys", "new", str(folder), "--rig", "bench", "--address", "192.0.2.5"]) == 0
    assert {path.stem for path in folder.glob("*.pem")} == {"authority", *ROLES}
    assert all(stat.S_IMODE(p.stat().st_mode) == 0o600 for p in folder.glob("*.key"))
    assert main(["keys", "issue", str(folder), "ann", "--role", "operator"]) == 0
    assert main(["keys", "issue", str(folder), "ann", "--role", "operator"]) == 0
    assert main(["keys", "revoke", str(folder), "ann"]) == 0
    capsys.readouterr()
    assert main(["keys", "show", str(folder)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[2] for line in lines if line.startswith("ann")] == ["revoked"] * 2
    assert sum("valid until" in line for line in lines) == len(ROLES)
    for wrong in (["new", str(folder), "--rig", "b"], ["issue", str(folder), "x", "--role", "king"],
                  ["revoke", str(folder), "ann"], ["show", str(tmp_path)],
                  ["new", str(tmp_path / "b"), "--rig", "a\udcff"],
                  ["issue", str(folder), "a" * 41, "--role", "operator"]):  # fmt: skip
        assert main(["keys", *wrong]) == 2
    assert capsys.readouterr().err.count("\n") == 6


def test_a_certificate_ends_with_its_authority_and_none_is_issued_after_that(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends = datetime.now(UTC) + timedelta(days=20)
    monkeypatch.setattr("rigwatch.keys.authority.AUTHORITY_DAYS", 20)
    issued = Authority.create(tmp_path / "keys", "bench").issue("daq", "daq")
    assert issued.ends in {f"{ends:%Y-%m-%d}", f"{datetime.now(UTC) + timedelta(days=20):%Y-%m-%d}"}
    # So a month before, the alarm of certificates that end tells of the authority too.
    assert ending_soon(read_register(tmp_path / "keys"), ends.date())
    monkeypatch.setattr("rigwatch.keys.authority.AUTHORITY_DAYS", -1 / 1440)
    ended = Authority.create(tmp_path / "ended", "bench")
    with pytest.raises(KeysError, match=r"ended: the authority has ended on .*`rigwatch keys new`"):
        ended.issue("daq", "daq")


def test_what_two_change_at_once_is_all_in_the_register(tmp_path: Path) -> None:
    """Whoever opened the register before another's change does not undo it: a lost key is lost."""
    first = Authority.create(tmp_path / "keys", "bench")
    for name in ("ann", "bob"):
        first.issue(name, "operator")
    second = Authority(tmp_path / "keys")
    first.revoke("ann")
    issued = second.issue("cleo", "operator")
    third = Authority(tmp_path / "keys")
    revoked = {one.name: one.revoked for one in third.register.issued}
    assert revoked == {"ann": True, "bob": False, "cleo": False}
    assert issued.serial == 3
    with pytest.raises(KeysError, match="has no valid certificate"):
        second.revoke("ann")

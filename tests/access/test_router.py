"""The router of a rig with keys follows the register, and counts what it refuses."""

import contextlib
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.keys import Authority
from rigwatch.router import RefusalLog
from rigwatch.router.report import RouterReport
from rigwatch.wire.bus import (
    DENIED_MARK,
    LINK_MARK,
    REFUSED_MARK,
    SILENT_MARK,
    Bus,
    connect,
    open_router,
)
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import BusError, KeysError
from rigwatch.wire.messages import ALARMS, COMMANDS, EVENTS, HEALTH, AlarmCommand, encode
from rigwatch.wire.rig_config import load_rig
from tests.access.secured_rig import SecuredRig, make_keys
from tests.bus.rig import TestRig
from tests.bus.test_complete_subscription import alarm
from tests.waiting import PATIENCE, eventually


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[SecuredRig]:
    with SecuredRig(tmp_path, make_keys(tmp_path / "keys")) as made:
        made.router()
        yield made


def heard_from(senders: dict[str, Bus], receiver: Bus) -> set[str]:
    """Whose commands arrive, when each sends one, until that of bob does."""
    commands = receiver.subscribe(COMMANDS)
    users: set[str] = set()

    def bob_heard() -> bool:
        for name, bus in senders.items():
            bus.publish(COMMANDS, AlarmCommand("*", "reset", name, 1))
        users.update(command.user for command in commands.drain())
        return "bob" in users

    eventually(bob_heard, "a command of bob")
    commands.close()
    return users


def test_a_revocation_a_new_and_a_renewed_certificate_are_in_force_without_a_restart(
    rig: SecuredRig,
) -> None:
    senders = {name: rig.bus(f"ack-{name}", rig.of(name)) for name in ("ann", "bob")}
    monitor, told = rig.bus("monitor"), rig.bus("recorder").subscribe(HEALTH)
    eventually(lambda: heard_from(senders, monitor) == {"ann", "bob"}, "both are heard")

    def reloads() -> float:
        found = [h.counters["register_reloads"] for h in told.drain() if h.source == "router"]
        return max(found, default=0.0)

    Authority(rig.keys).revoke("ann")
    eventually(lambda: reloads() == 1.0, "the register is read again")
    assert heard_from(senders, monitor) == {"bob"}
    Authority(rig.keys).issue("carl", "operator")
    senders["carl"] = rig.bus("ack-carl", rig.of("carl"))
    eventually(lambda: heard_from(senders, monitor) == {"bob", "carl"}, "carl is heard")
    Authority(rig.keys).issue("bob", "operator")
    eventually(lambda: reloads() >= 3.0, "the register is read once more")
    eventually(lambda: heard_from(senders, monitor) == {"bob", "carl"}, "both are heard again")
    (rig.keys / "register.json").write_text("{")
    assert "bob" in heard_from(senders, monitor)


def test_refused_connections_and_denied_messages_are_counted_and_reported(
    rig: SecuredRig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    observer = rig.bus("recorder")
    healths, events = observer.subscribe(HEALTH), observer.subscribe(EVENTS)
    alarms = observer.subscribe(ALARMS)  # without a subscriber the sender itself drops them
    newest: dict[str, float] = {}

    def counted(name: str) -> float:
        for health in healths.drain():
            if health.source == "router":
                newest.update(health.counters)
        return newest.get(name, -1.0)

    eventually(lambda: counted("denied_messages") >= 0, "the router reports")
    denied = counted("denied_messages")
    stranger = rig.bus("dashboard")
    for _ in range(3):
        stranger.transport.put(stranger.key(ALARMS.key), encode(alarm(666)))
    assert stranger.query("monitor/model", b"{}", 0.2) == []
    eventually(lambda: counted("denied_messages") >= denied + 4, "four denials")
    assert counted("denied_messages") == denied + 4
    assert alarms.drain() == []

    refused = counted("refused_connections")
    other = make_keys(tmp_path / "other")
    (tmp_path / "other.toml").write_text(rig.path.read_text().replace(str(rig.keys), str(other)))
    with pytest.raises(BusError, match="no router answers"):
        connect(load_rig(tmp_path / "other.toml"), "monitor", 0.5)
    monkeypatch.setattr("rigwatch.keys.authority.CERTIFICATE_DAYS", -1 / 86_400)
    Authority(rig.keys).issue("ann", "operator")
    with pytest.raises(BusError, match=r"ann\.pem has ended on .*`rigwatch keys issue`"):
        connect(rig.config, "ack", 0.5)
    eventually(lambda: counted("refused_connections") > refused, "the refusal is counted")
    eventually(lambda: any(e.code == "ACCESS REFUSED" for e in events.drain()), "an event")


@pytest.mark.parametrize("keys", [False, True])
def test_silent_connections_are_counted_and_reported(tmp_path: Path, *, keys: bool) -> None:
    made = SecuredRig(tmp_path, make_keys(tmp_path / "keys")) if keys else TestRig(tmp_path)
    with made as rig, contextlib.ExitStack() as lines:
        rig.router()
        observer = rig.bus("recorder")
        healths, events = observer.subscribe(HEALTH), observer.subscribe(EVENTS)

        def refused() -> float:
            found = [
                h.counters["refused_connections"] for h in healths.drain() if h.source == "router"
            ]
            return found[-1] if found else -1.0

        before = -1.0

        def reported() -> bool:
            nonlocal before
            before = refused()
            return before >= 0

        eventually(reported, "the router reports")
        for number in range(4):
            line = socket.create_connection(("127.0.0.1", rig.listen), 5.0)
            lines.enter_context(line)
            if number == 3 and not keys:
                line.sendall(b"GET / HTTP/1.0\r\n\r\n")
        eventually(lambda: refused() == before + 4, "each is counted, and no other")
        eventually(lambda: any(e.code == "ACCESS REFUSED" for e in events.drain()), "an event")


def test_certificates_that_end_are_told_once_a_day_from_a_month_before(tmp_path: Path) -> None:
    keys = make_keys(tmp_path / "keys")
    config = SecuredRig(tmp_path, keys).config
    report = RouterReport(config, RefusalLog(), threading.Event())
    network = MemoryNetwork()
    observer, router = network.bus("bench", "recorder"), network.bus("bench", "router")
    healths, events = observer.subscribe(HEALTH), observer.subscribe(EVENTS)
    two_years, day_ns = time.time_ns() + 730 * 86_400 * 10**9, 86_400 * 10**9
    said = []
    for day in range(-33, 2):
        for second in (0.0, 61.0):
            report.turn(router, 86_400.0 * day + second, two_years + day * day_ns)
        said.append((len(events.drain()), healths.drain()[-1].counters["certificate_days"]))
    assert said[:3] == [(0, 33.0), (0, 32.0), (0, 31.0)]
    assert said[3:] == [(1, float(-day)) for day in range(-30, 2)]


def test_the_log_of_refusals_passes_everything_else_on() -> None:
    log = RefusalLog()
    lines = [b"WARN " + REFUSED_MARK + b": eof", b"something else", b"x " + DENIED_MARK, b"last"]
    lines[1:1] = [b"DEBUG " + LINK_MARK + b": New transport", b"DEBUG " + LINK_MARK + SILENT_MARK]
    text = b"\n".join(lines) + b"\n"
    passed = b"".join(log.take(text[i : i + 7]) for i in range(0, len(text), 7))
    assert passed == b"something else\nlast\n"
    assert (log.connections, log.messages) == (2, 1)
    passed = log.take(b"y" * 70_000)
    assert len(passed) == 70_001


REFUSALS = f"""
import os, sys, time
from rigwatch.router import RefusalLog
log = RefusalLog()
log.open()
os.write(1, b"something else\\n" * 20_000)
for _ in range(100):
    os.write(1, b"x {DENIED_MARK.decode()}\\n" * 1000)
while log.messages < 100_000:
    time.sleep(0.01)
log.close()
"""


@pytest.mark.parametrize("output", ["stalled", "closed", "full"])
def test_refusals_are_counted_and_the_router_goes_on_whatever_becomes_of_the_output(
    output: str,
) -> None:
    reading, writing = os.pipe()
    if output == "closed":
        os.close(reading)
    if output == "full":
        os.close(writing)
        writing = os.open("/dev/full", os.O_WRONLY)
    command = [sys.executable, "-c", REFUSALS]
    with subprocess.Popen(command, stdout=writing, stderr=subprocess.DEVNULL) as log:
        os.close(writing)
        try:
            assert log.wait(PATIENCE) == 0
        finally:
            log.kill()


@pytest.mark.parametrize(
    ("damaged", "content", "words"),
    [
        ("router.key", "x", r"router\.key: found no private key in PEM"),
        ("router.key", "daq.key", r"router\.key: found the key of another certificate"),
        ("router.pem", "x", r"router\.pem: found no certificate in PEM"),
        ("authority.pem", "x", r"authority\.pem: found no certificate in PEM"),
    ],
)
def test_a_damaged_key_is_named_where_the_address_would_be_blamed(
    damaged: str, content: str, words: str, keys: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "keys"
    shutil.copytree(keys, folder)
    source = keys / content
    (folder / damaged).write_bytes(source.read_bytes() if source.is_file() else b"x")
    config = SecuredRig(tmp_path, folder).config
    with pytest.raises(KeysError, match=words):
        open_router(config)


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_keys(tmp_path_factory.mktemp("made") / "keys")


def test_a_key_that_the_account_may_not_read_is_named(
    keys: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda path, _: Path(path).name != "daq.key")
    config = SecuredRig(tmp_path, keys).config
    with pytest.raises(KeysError, match=r"daq\.key: this account may not read it"):
        connect(config, "daq", 0.1)


ENDED_AT_ONCE = """
import sys, threading, time
from contextlib import contextmanager
from rigwatch import router
from rigwatch.router import report
from rigwatch.wire.rig_config import load_rig

joined = report.joined

@contextmanager
def left_slowly(*arguments):
    with joined(*arguments) as bus:
        yield bus
    time.sleep(0.5)

report.joined = left_slowly
stop = threading.Event()
threading.Timer(float(sys.argv[2]), stop.set).start()
router.run(load_rig(sys.argv[1]), stop)
assert "router report" not in [thread.name for thread in threading.enumerate()]
"""


@pytest.mark.parametrize("after_s", [0.0, 0.1, 0.4])
def test_a_router_that_ends_leaves_no_thread_in_zenoh(tmp_path: Path, after_s: float) -> None:
    path = TestRig(tmp_path).path
    words = [sys.executable, "-c", ENDED_AT_ONCE, str(path), str(after_s)]
    assert subprocess.run(words, check=False, timeout=PATIENCE).returncode == 0

"""Notices reach people by command, webhook and e-mail; what fails is repeated, counted and told."""

import contextlib
import json
import socket
import socketserver
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import ALARMS, ESTIMATES, HEALTH, Health
from rigwatch.wire.rig_config import WitnessSection
from rigwatch.witness import waiting
from rigwatch.witness.addresses import senders
from rigwatch.witness.addresses.bounded import MOST_HUNG
from rigwatch.witness.notices import Notice
from rigwatch.witness.process import Witness
from tests.waiting import eventually
from tests.witness.test_people import fault
from tests.witness.test_witness import estimates

ROOT = Path(__file__).parents[2]


class Webhook(ThreadingHTTPServer):
    """Takes what is posted; answers with `status`."""

    def __init__(self) -> None:
        self.status, self.got, self.gate = 200, list[dict[str, Any]](), threading.Event()
        self.gate.set()
        super().__init__(("127.0.0.1", 0), _Handler)
        threading.Thread(target=self.serve_forever, daemon=True).start()


class _Handler(BaseHTTPRequestHandler):
    server: Webhook

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.gate.wait()
        if self.server.status == 200:
            self.server.got.append(json.loads(body))
        self.send_response(self.server.status)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def webhook() -> Iterator[Webhook]:
    server = Webhook()
    yield server
    server.gate.set()
    server.shutdown()
    server.server_close()


class Bench:
    """A witness on a bus in memory, turned by hand."""

    def __init__(self, folder: Path, people: str) -> None:
        self.file = folder / "people.toml"
        self.file.write_text(people)
        network = MemoryNetwork()
        self.monitor, self.screen = network.bus("r", "monitor"), network.bus("r", "screen")
        self._healths = self.screen.subscribe(HEALTH)
        self.health: Health | None = None
        settings = WitnessSection(people=str(self.file), stale_after=1e6)
        self.witness = Witness(settings, network.bus("r", "witness"), 0.0)
        self.now = 0.0

    def turn(self) -> None:
        self.now += 0.1
        self.witness.turn(self.now, 1)
        self.health = (self._healths.drain() or [self.health])[-1]

    def counted(self, name: str) -> float:
        self.turn()
        return self.health.counters[f"notifications_{name}"] if self.health else 0.0


def test_webhook_and_command_are_told_and_a_slow_one_delays_nobody(
    tmp_path: Path, webhook: Webhook
) -> None:
    told = tmp_path / "told"
    code = f"import sys; open({str(told)!r}, 'a').write(' '.join(sys.argv[1:3]) + chr(10))"
    command = ", ".join(map(json.dumps, (sys.executable, "-c", code)))
    port = webhook.server_port
    bench = Bench(
        tmp_path,
        f'[[recipients]]\nname = "hook"\nurl = "json://127.0.0.1:{port}/alarms"\n'
        f'[[recipients]]\nname = "program"\ncommand = [{command}]\n',
    )
    webhook.gate.clear()
    bench.monitor.publish(ALARMS, fault())
    eventually(lambda: bench.counted("sent") == 1.0, "the command")
    assert told.read_text() == "stale error\n"
    webhook.gate.set()
    eventually(lambda: bench.counted("sent") == 2.0, "the webhook")
    assert webhook.got[0]["title"] == "[r] error: stale"
    assert "why" in webhook.got[0]["message"]
    assert bench.counted("failed") == 0.0


def test_a_notice_waits_until_the_recipient_is_reached_again(
    tmp_path: Path, webhook: Webhook, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting, "PAUSES_S", (0.01,))
    url = f"json://127.0.0.1:{webhook.server_port}"
    bench = Bench(tmp_path, f'[[recipients]]\nname = "hook"\nurl = "{url}"\n')
    webhook.status = 500
    bench.monitor.publish(ALARMS, fault())
    eventually(lambda: bench.counted("failed") >= 6.0, "attempts without end")

    def text() -> str:
        bench.turn()
        return bench.health.text if bench.health else ""

    eventually(lambda: text() == "notifications to hook fail", "the health")
    assert bench.counted("waiting") == 1.0
    webhook.status = 200
    eventually(lambda: text() == "", "it works again")
    assert bench.counted("sent") == 1.0
    assert [one["title"] for one in webhook.got] == ["[r] error: stale"]
    assert bench.counted("waiting") == bench.counted("given_up") == 0.0


def test_what_somebody_has_seen_meanwhile_is_not_sent(tmp_path: Path, webhook: Webhook) -> None:
    url = f"json://127.0.0.1:{webhook.server_port}"
    bench = Bench(tmp_path, f'[[recipients]]\nname = "hook"\nurl = "{url}"\n')
    webhook.status = 500
    for name in ("seen", "open"):
        bench.monitor.publish(ALARMS, fault(name))
    eventually(lambda: bench.counted("failed") >= 1.0, "a failure")
    bench.monitor.publish(ALARMS, fault("seen", state="acknowledged"))
    eventually(lambda: bench.counted("waiting") == 1.0, "one is withdrawn")
    webhook.status = 200
    eventually(lambda: bench.counted("sent") == 1.0, "the other")
    assert webhook.got[0]["title"] == "[r] error: open"
    assert bench.counted("withdrawn") + bench.counted("given_up") == 1.0


def test_a_flood_at_a_recipient_that_is_slow_comes_whole_in_few_messages_the_worst_first(
    tmp_path: Path, webhook: Webhook
) -> None:
    url = f"json://127.0.0.1:{webhook.server_port}"
    bench = Bench(tmp_path, f'[[recipients]]\nname = "hook"\nurl = "{url}"\nlowest = "warning"\n')
    webhook.gate.clear()
    bench.monitor.publish(ALARMS, fault("first"))
    eventually(lambda: bench.counted("waiting") == 1.0, "the webhook is busy")
    names = [f"alarm-{number}" for number in range(299)]
    for name in names:
        bench.monitor.publish(ALARMS, fault(name, severity="warning"))
    bench.monitor.publish(ALARMS, fault("dry_friction", severity="critical"))
    eventually(lambda: bench.counted("waiting") == 301.0, "all wait")
    webhook.gate.set()
    eventually(lambda: bench.counted("sent") == 301.0, "all of them")
    assert webhook.got[1]["title"] == "[r] 50 alarms, critical: dry_friction"
    assert webhook.got[1]["message"].startswith("critical: dry_friction: why (")
    assert len(webhook.got) == 1 + 6
    told = [line.split(": ")[1] for one in webhook.got[1:] for line in one["message"].split("\n")
            if line.startswith(("warning: ", "critical: "))]  # fmt: skip
    assert told == ["dry_friction", *names]


@pytest.mark.parametrize("scheme", ["json", "jsons", "mailto"])
def test_addresses_that_answer_without_end_fail_and_hold_neither_threads_nor_what_follows(
    scheme: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(senders, "ADDRESS_S", 0.3)
    monkeypatch.setattr(waiting, "PAUSES_S", (0.01,))
    with Drip() as drip:
        whom = "?to=a@b.example&from=a@b.example" if scheme == "mailto" else ""
        url = f"{scheme}://127.0.0.1:{drip.server_address[1]}/{whom}"
        bench = Bench(tmp_path, f'[[recipients]]\nname = "hook"\nurl = "{url}"\n')
        for count in range(MOST_HUNG + 2):
            bench.monitor.publish(ALARMS, fault(f"alarm-{count}"))
        eventually(lambda: bench.counted("failed") >= 2.0 * MOST_HUNG, "all have failed")
        assert bench.health is not None
        assert bench.health.text == "notifications to hook fail"
        bench.file.write_text("")
        bench.now += 10.0
        bench.turn()
        eventually(lambda: "notify" not in names_of_threads(), "no attempt is left behind")
        drip.shutdown()


def names_of_threads() -> list[str]:
    return [thread.name for thread in threading.enumerate()]


_CHILD = """
import sys
from pathlib import Path
from tests.witness.test_delivery import ALARMS, Bench, fault
bench = Bench(Path(sys.argv[1]), sys.argv[2])
bench.monitor.publish(ALARMS, fault("loss"))
bench.turn()
input()
"""


def test_a_process_ends_though_an_address_answers_without_end(tmp_path: Path) -> None:
    with Drip() as drip:
        url = f"json://127.0.0.1:{drip.server_address[1]}"
        people = f'[[recipients]]\nname = "hook"\nurl = "{url}"\n'
        words = [sys.executable, "-c", _CHILD, str(tmp_path), people]
        with subprocess.Popen(words, cwd=ROOT, stdin=subprocess.PIPE) as child:
            try:
                assert drip.asked.wait(30.0)
                child.communicate(b"\n", timeout=10.0)
            finally:
                child.kill()
        drip.shutdown()


class Drip(socketserver.ThreadingTCPServer):
    """A server that answers with the same bytes again and again, without end.

    Args:
        answer: the bytes.
        begin: what it does with a new connection before; returns the bytes.
    """

    daemon_threads = True

    def __init__(
        self, answer: bytes = b"H", begin: Callable[[socket.socket], bytes] | None = None
    ) -> None:
        self.begin = begin or (lambda _: answer)
        super().__init__(("127.0.0.1", 0), _Dripping)
        self.asked = threading.Event()
        threading.Thread(target=self.serve_forever, daemon=True).start()


class _Dripping(socketserver.BaseRequestHandler):
    def handle(self) -> None:
        assert isinstance(self.server, Drip)
        self.server.asked.set()
        with contextlib.suppress(OSError):
            answer = self.server.begin(self.request)
            while True:
                self.request.sendall(answer)
                time.sleep(0.05)


def test_a_command_that_hangs_is_killed_with_what_it_has_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(senders, "COMMAND_S", 0.2)
    started = tmp_path / "started"
    script = f"sleep 600 & echo $! > {started}.new; mv {started}.new {started}; wait"
    notice = Notice("people", fault("gap", 1.0), 0, 0.0)
    with pytest.raises(subprocess.TimeoutExpired):
        senders._run_command(("sh", "-c", script), notice, "r")
    child = Path("/proc") / started.read_text().strip() / "stat"
    eventually(lambda: not child.exists() or ") Z " in child.read_text(), "its child has ended")


def test_a_changed_file_is_in_force_and_a_wrong_one_changes_nothing(
    tmp_path: Path, webhook: Webhook
) -> None:
    bench = Bench(tmp_path, "")
    bench.file.write_text("[[recipients]]\n")

    def text() -> str:
        bench.turn()
        return bench.health.text if bench.health else ""

    eventually(lambda: "the recipients remain as they were" in text(), "the mistake is told")
    url = f"json://127.0.0.1:{webhook.server_port}"
    bench.file.write_text(f'[[recipients]]\nname = "new"\nurl = "{url}"\n')
    eventually(lambda: text() == "", "the file is read again")
    bench.monitor.publish(ALARMS, fault())
    eventually(lambda: bench.counted("sent") == 1.0, "the new recipient is told")


def test_an_alarm_that_stood_before_the_witness_is_told(tmp_path: Path, webhook: Webhook) -> None:
    file = tmp_path / "people.toml"
    url = f"json://127.0.0.1:{webhook.server_port}"
    file.write_text(f'[[recipients]]\nname = "hook"\nurl = "{url}"\n')
    network = MemoryNetwork()
    from rigwatch.wire.bus import serve_alarm_list

    serve_alarm_list(network.bus("r", "monitor"), lambda: [fault()])
    settings = WitnessSection(people=str(file))
    witness = Witness(settings, network.bus("r", "witness"), 0.0)
    witness.turn(0.1, 1)
    eventually(lambda: len(webhook.got) == 1, "the notice")


def test_a_monitor_that_did_not_answer_is_asked_again(tmp_path: Path, webhook: Webhook) -> None:
    url = f"json://127.0.0.1:{webhook.server_port}"
    bench = Bench(tmp_path, f'[[recipients]]\nname = "hook"\nurl = "{url}"\n')
    from rigwatch.wire.bus import serve_alarm_list

    serve_alarm_list(bench.monitor, lambda: [fault()])
    bench.now += 10.0
    bench.turn()
    assert bench.counted("waiting") == 0.0  # nobody is there who could be asked
    bench.monitor.publish(ESTIMATES, estimates(0))
    eventually(lambda: bench.counted("sent") == 1.0, "the notice")


def test_an_address_that_cannot_be_used_is_told_without_its_secrets(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"recipients\.ann\.url") as refused:
        Bench(tmp_path, '[[recipients]]\nname = "ann"\nurl = "nosuch://user:secret@host"\n')
    assert "secret" not in str(refused.value)


class Mailbox(socketserver.ThreadingTCPServer):
    """As much of an SMTP server as takes one letter."""

    allow_reuse_address = daemon_threads = True

    def __init__(self) -> None:
        self.letters: list[str] = []
        super().__init__(("127.0.0.1", 0), _Smtp)
        threading.Thread(target=self.serve_forever, daemon=True).start()


class _Smtp(socketserver.StreamRequestHandler):
    server: Mailbox

    def handle(self) -> None:
        self.wfile.write(b"220 here\r\n")
        while line := self.rfile.readline():
            if line.upper().startswith(b"DATA"):
                self.wfile.write(b"354 go\r\n")
                letter = b"".join(iter(self.rfile.readline, b".\r\n"))
                self.server.letters.append(letter.decode())
            self.wfile.write(b"221 bye\r\n" if line.upper().startswith(b"QUIT") else b"250 ok\r\n")


def test_an_e_mail_is_sent(tmp_path: Path) -> None:
    mailbox = Mailbox()
    port = mailbox.server_address[1]
    assert isinstance(port, int)
    url = f"mailto://127.0.0.1:{port}?from=rig@example.org&to=ann@example.org&mode=insecure"
    bench = Bench(tmp_path, f'[[recipients]]\nname = "ann"\nurl = "{url}"\n')
    bench.monitor.publish(ALARMS, fault())
    eventually(lambda: bench.counted("sent") + bench.counted("failed") > 0, "an attempt")
    assert bench.counted("sent") == 1.0
    assert "[r] error: stale" in mailbox.letters[0]
    mailbox.shutdown()
    mailbox.server_close()


def test_an_unreachable_host_blocks_nobody(tmp_path: Path) -> None:
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        url = f"json://127.0.0.1:{closed.getsockname()[1]}"
        bench = Bench(tmp_path, f'[[recipients]]\nname = "gone"\nurl = "{url}"\n')
        bench.monitor.publish(ALARMS, fault())
        eventually(lambda: bench.counted("failed") >= 1.0, "the failure is counted")

"""An attack on a secured rig of real processes, and what is looked at meanwhile."""

import contextlib
import json
import socket
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rigwatch.wire.bus import MAX_PAYLOAD, Bus
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.messages import ALARMS, EVENTS, GAPS, HEALTH, MODELS, RUN, SampleBlock
from tests.access.rogue import ALLOWED_SAID, BOOT
from tests.access.secured_rig import SecuredRig, make_keys
from tests.bus.publisher import wave
from tests.monitor_process.model import monitor_section
from tests.waiting import eventually

STRANGERS = ("dashboard", "recorder", "device", "ack-eve")
"""Roles of the hostile clients, the last an operator."""
MARK = b"\x01" * 16
PACE_S = 0.0005
"""Pause between two messages, below the rate at which Zenoh drops some [s]."""


@dataclass
class Outcome:
    """Counts of an attack.

    Attributes:
        sent: messages and queries by what the access list does with them.
        denied, refused: as counted by the router and by the monitor.
        samples, wrong: samples delivered to a reader, and those that differ from the real ones.
        ended: processes that ended.
        changes: model changes, changed model files and alarms by an operator.
        connections, refused_connections: attempts without a certificate, and those counted.
    """

    sent: Counter[str] = field(default_factory=Counter)
    denied: float = 0.0
    refused: float = 0.0
    samples: int = 0
    wrong: int = 0
    lost: int = 0
    ended: list[str] = field(default_factory=list)
    changes: list[str] = field(default_factory=list)
    connections: int = 0
    refused_connections: float = 0.0


class Attacked:
    """A secured rig with router, source, monitor and witness, and hostile clients."""

    def __init__(self, folder: Path) -> None:
        keys = make_keys(folder / "keys")
        section = monitor_section(folder) + "\n[witness]\n"
        section += f'\n[recorder]\nfolder = "{folder}/sessions"\n'
        self.rig = SecuredRig(folder, keys, section)
        self.model = folder / "model.toml"
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.outcome = Outcome()
        self.newest: Counter[str] = Counter()

    def start(self) -> None:
        """Start all processes and wait for estimates."""
        rig = self.rig
        self.processes["router"] = rig.router()
        for name in ("monitor", "witness"):
            self.processes[name] = rig.start("-m", "rigwatch", name, str(rig.path))
        self.observer = rig.bus("operator-watching")
        there = {"alive/monitor", "alive/witness"}
        eventually(lambda: there <= set(self.observer.tokens("alive/*")), "monitor and witness")
        self._text = self.model.read_text()
        self._models, self._alarms = (self.observer.subscribe(t) for t in (MODELS, ALARMS))
        self._healths = self.observer.subscribe(HEALTH)
        # A topic without a subscriber: the sender itself drops its messages.
        self._others = [self.observer.subscribe_lossy(topic) for topic in (EVENTS, GAPS, RUN)]
        self.processes["daq"] = rig.publisher(BOOT, "--wave")
        self._reader = SampleReader(self.observer)
        self.clients = [rig.bus(name) for name in STRANGERS]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        eventually(lambda: self.outcome.samples > 0, "samples")
        eventually(lambda: "router denied_messages" in self.newest, "the router's figures")
        eventually(lambda: "monitor commands_refused" in self.newest, "the monitor's figures")

    def _watch(self) -> None:
        """Compare every sample delivered with the real one, and note figures and changes."""
        while not self._ended.is_set():
            for item in self._reader.read(0.05):
                if isinstance(item, SampleBlock):
                    self._compare(item)
            for health in self._healths.drain():
                for name, value in health.counters.items():
                    key = f"{health.source} {name}"
                    # A forged health message cannot lower what was counted.
                    self.newest[key] = max(self.newest[key], value)
            changed = [change.user for change in self._models.drain()]
            changed += [alarm.name for alarm in self._alarms.drain() if alarm.user]
            self.outcome.changes += changed

    def _compare(self, block: SampleBlock) -> None:
        self.outcome.samples += len(block)
        for index in range(len(block)):
            real = wave(block.seq + index, 1, BOOT, 0)
            same = block.boot == BOOT and all(
                np.array_equal(one.values[index : index + 1], other.values)
                for one, other in zip(block.channels, real.channels, strict=False)
            )
            self.outcome.wrong += not same

    def attack(self, messages: Iterable[tuple[str, str, bytes]], until: float) -> None:
        """Send messages from all clients in turn, until all are sent or it is `until` [s]."""
        for number, (how, key, payload) in enumerate(messages):
            if time.monotonic() > until:
                return
            client = self.clients[number % len(self.clients)]
            _send(client, how, key, payload)
            self.outcome.sent[_fate(client, how, key, len(payload))] += 1
            time.sleep(PACE_S)

    def knock(self, times: int) -> None:
        """Connect without a certificate: plain bytes, which no TLS handshake begins with."""
        for number in range(times):
            with (
                contextlib.suppress(OSError),
                socket.create_connection(("127.0.0.1", self.rig.listen), 5.0) as line,
            ):
                line.sendall(b"GET / HTTP/1.0\r\n\r\n" if number % 2 else bytes(64))
                line.settimeout(5.0)
                while line.recv(4096):
                    pass
            self.outcome.connections += 1

    def judge(self) -> Outcome:
        """Wait until the counts stand still; what has happened."""
        time.sleep(2.5)
        self._ended.set()
        self._thread.join()
        outcome = self.outcome
        outcome.lost = self._reader.counters.lost
        outcome.ended = [n for n, p in self.processes.items() if p.poll() is not None]
        if self.model.read_text() != self._text:
            outcome.changes.append("model file")
        journal = (self.rig.folder / "alarms.jsonl").read_text().splitlines()
        outcome.changes += [n for n in map(_operator, journal) if n]
        outcome.denied = self.newest["router denied_messages"]
        outcome.refused_connections = self.newest["router refused_connections"]
        outcome.refused = self.newest["monitor commands_refused"]
        outcome.refused += self.newest["monitor commands_lost"]
        return outcome


def _operator(line: str) -> str:
    return str(json.loads(line)["alarm"]["user"])


def _send(client: Bus, how: str, key: str, payload: bytes) -> None:
    if how == "put":
        client.transport.put(client.key(key), payload, MARK)
    else:
        client.query(key, payload, timeout=0.05)


def _fate(client: Bus, how: str, key: str, size: int) -> str:
    """What the access list does with a message: "denied", "allowed", or a command to verify."""
    operator = client.process.startswith("ack")
    if size + (len(MARK) if how == "put" else 0) > MAX_PAYLOAD:
        return "denied"
    if how == "ask":
        asks_model = key in ("monitor/model", "monitor/receiver")
        return "denied" if asks_model and not operator else "asked"
    if key in ALLOWED_SAID or (key == "run" and client.process == "recorder"):
        return "allowed"
    return "command" if operator and key == "monitor/commands" else "denied"


@contextlib.contextmanager
def attacked(folder: Path) -> Iterator[Attacked]:
    """A rig under attack, ended afterwards."""
    made = Attacked(folder)
    with made.rig:
        made.start()
        yield made

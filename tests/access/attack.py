"""An attack on a rig of real processes, with or without keys, and what is looked at meanwhile.

With keys the router forwards nothing that a role may not say. Without keys it forwards everything
but oversized messages, and the processes themselves have to drop what is not their owners'.
"""

import contextlib
import json
import random
import socket
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from daq.known_device import read_devices
from rigwatch.wire.bus import DEVICE_KEY, DEVICE_RUN_KEY, MAX_PAYLOAD, Bus
from rigwatch.wire.bus import KEY as MODEL_KEY
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import (
    ALARMS,
    COMMANDS,
    EVENTS,
    GAPS,
    HEALTH,
    MODELS,
    PAST_KEY,
    RUN,
    SAMPLES,
    TOPICS,
    SampleBlock,
    decode,
)
from tests.access.rogue import ALLOWED_SAID, BOOT
from tests.access.secured_rig import SecuredRig, make_keys
from tests.bus.publisher import DEVICE, wave
from tests.bus.rig import TestRig
from tests.monitor_process.model import monitor_section
from tests.waiting import eventually

STRANGERS = ("dashboard", "recorder", "device", "ack-eve")
"""Roles of the hostile clients, the last an operator."""
MARK = b"\x01" * 16
FOR_OPERATORS = (MODEL_KEY, "monitor/receiver", DEVICE_KEY, DEVICE_RUN_KEY, PAST_KEY)
NUMBERED = tuple(topic.key for topic in TOPICS if topic.numbered)
OF_RECORDERS = ("run", "health/recorder", "gaps/recorder")
RECEIVERS = ("monitor", "witness", "daq/rig")
"""Processes that receive commands: about models and alarms, the witness's own alarm, the device."""
DROPPED = ("rejected", "foreign_samples", "duplicate_samples")
"""Counters of the monitor for what it does not take for samples of its rig."""
PACE_S = 0.0005
"""Pause between two messages, below the rate at which Zenoh drops some [s]."""


@dataclass
class Outcome:
    """Counts of an attack.

    Attributes:
        sent: messages and queries by what becomes of them: "denied" by the router, "allowed",
            "asked", a "command", "samples" (each of them) or what is "numbered", which a process
            has to refuse.
        denied, refused: as counted by the router, and by those who receive commands.
        dropped: payloads and samples that the monitor has not taken for samples of its rig.
        foreign: alarms, estimates and model changes that the recorder has not taken.
        samples, wrong: samples delivered to a reader, and those that differ from the real ones.
        ended: processes that ended.
        changes: model changes, changed files of model and device, and alarms by an operator.
        connections, refused_connections: attempts without a certificate, and those counted.
    """

    sent: Counter[str] = field(default_factory=Counter)
    denied: float = 0.0
    refused: float = 0.0
    dropped: float = 0.0
    foreign: float = 0.0
    samples: int = 0
    wrong: int = 0
    lost: int = 0
    ended: list[str] = field(default_factory=list)
    changes: list[str] = field(default_factory=list)
    connections: int = 0
    refused_connections: float = 0.0


class Attacked:
    """A rig with router, source, monitor and witness, and hostile clients.

    Args:
        folder: of all files.
        keys: whether the rig has keys; the clients then have certificates of other roles.
    """

    def __init__(self, folder: Path, *, keys: bool = True) -> None:
        section = monitor_section(folder) + "\n[witness]\n"
        section += f'\n[recorder]\nfolder = "{folder}/sessions"\n'
        self.keys = keys
        if keys:
            self.rig: TestRig = SecuredRig(folder, make_keys(folder / "keys"), section)
        else:
            self.rig = TestRig(folder, f'{section}[bus.security]\nsecret = "{folder}/own/secret"\n')
        self.model = folder / "model.toml"
        self._device_file = folder / "device.json"
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.outcome = Outcome()
        self.newest: Counter[str] = Counter()
        self._chance = random.Random(3)

    def start(self) -> None:
        """Start all processes and wait for estimates."""
        rig = self.rig
        self.processes["router"] = rig.router()
        for name, command in (
            ("monitor", "monitor"),
            ("witness", "witness"),
            ("recorder", "record"),
        ):
            self.processes[name] = rig.start("-m", "rigwatch", command, str(rig.path))
        self.observer = rig.bus("operator-watching")
        there = {"alive/monitor", "alive/witness", "alive/recorder"}
        eventually(lambda: there <= set(self.observer.tokens("alive/*")), "all processes")
        self._text = self.model.read_text()
        self._models, self._alarms = (self.observer.subscribe(t) for t in (MODELS, ALARMS))
        self._healths = self.observer.subscribe(HEALTH)
        # A topic without a subscriber: the sender itself drops its messages.
        self._others = [self.observer.subscribe_lossy(topic) for topic in (EVENTS, GAPS, RUN)]
        self.processes["daq"] = rig.publisher(BOOT, "--wave", "--desk", str(self._device_file))
        self._reader = SampleReader(self.observer)
        self.clients = [rig.bus(name) for name in STRANGERS]
        if not self.keys:
            for client in self.clients:
                client.signer = None  # only the rig's own account can read its secret
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        eventually(lambda: self.outcome.samples > 0, "samples")
        if self.keys:
            eventually(lambda: "router denied_messages" in self.newest, "the router's figures")
        for process in RECEIVERS:
            name = f"{process} commands_refused"
            eventually(lambda n=name: n in self.newest, f"the figures of the {process}")  # type: ignore[misc]
        eventually(lambda: "recorder foreign_messages" in self.newest, "those of the recorder")

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
        """Send messages, each from a client that is drawn, until all are sent or `until` [s]."""
        for how, key, payload in messages:
            if time.monotonic() > until:
                return
            client = self._chance.choice(self.clients)
            _send(client, how, key, payload)
            fate = self._fate(client, how, key, payload)
            self.outcome.sent[fate] += len_of_samples(payload) if fate == "samples" else 1
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
        if [met.identity for met in read_devices(self._device_file)] != [DEVICE]:
            outcome.changes.append("device")
        outcome.denied = self.newest["router denied_messages"]
        outcome.refused_connections = self.newest["router refused_connections"]
        outcome.refused = self._counted("commands_refused", "commands_lost")
        outcome.dropped = self._counted(*DROPPED)
        recorder = ("foreign_messages", "dropped_messages")
        outcome.foreign = sum(self.newest[f"recorder {name}"] for name in recorder)
        return outcome

    def _counted(self, *names: str) -> float:
        """Sum of counters of those who receive commands."""
        return sum(self.newest[f"{who} {name}"] for who in RECEIVERS for name in names)

    def _fate(self, client: Bus, how: str, key: str, payload: bytes) -> str:
        """What becomes of a message, by the access list or without one."""
        size = len(payload) + (len(MARK) if how == "put" else 0)
        if size > MAX_PAYLOAD:
            return "denied"
        if self.keys and not _allowed_by_role(client, how, key):
            return "denied"
        if key in (COMMANDS.key, MODEL_KEY) or (key == DEVICE_KEY and payload):
            return "command"  # a request about the device without content asks which it is
        if how == "ask":
            return "asked"
        if key in NUMBERED:
            return "numbered"
        return "samples" if key == SAMPLES.key else "allowed"


def len_of_samples(payload: bytes) -> int:
    """How much is counted for a message in place of samples: each sample, or the payload."""
    try:
        return len(decode(SampleBlock, payload))
    except MessageError:
        return 1


def _operator(line: str) -> str:
    return str(json.loads(line)["alarm"]["user"])


def _send(client: Bus, how: str, key: str, payload: bytes) -> None:
    if how == "put":
        client.transport.put(client.key(key), payload, MARK)
    else:
        client.query(key, payload, timeout=0.05)


def _allowed_by_role(client: Bus, how: str, key: str) -> bool:
    """Whether the access list lets a message pass."""
    operator = client.process.startswith("ack")
    if how == "ask":
        return operator or key not in FOR_OPERATORS
    if key in OF_RECORDERS:
        return client.process == "recorder"
    return key in ALLOWED_SAID or (operator and key == COMMANDS.key)


@contextlib.contextmanager
def attacked(folder: Path, *, keys: bool = True) -> Iterator[Attacked]:
    """A rig under attack, ended afterwards."""
    made = Attacked(folder, keys=keys)
    with made.rig:
        made.start()
        yield made

"""A hostile client: 200 kinds of message for every topic and queryable of a rig.

The kinds are drawn once from a seed: forged messages of every class, mutated and cut bytes, random
bytes, oversized payloads, questions to rings, requests for models, expensive TOML and JSON.
"""

import json
import random
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rigwatch.wire.bus import DEVICE_KEY, DEVICE_RUN_KEY, KEY, MAX_PAYLOAD
from rigwatch.wire.bus.commands.shelf import SHELF_KEY
from rigwatch.wire.messages import (
    PAST_KEY,
    RING_KEY,
    TOPICS,
    Alarm,
    AlarmCommand,
    EstimateBlock,
    Event,
    Gap,
    Health,
    Message,
    ModelChange,
    RunInfo,
    encode,
)
from rigwatch.wire.ordering import Ask
from tests.bus.publisher import wave

KINDS = 200
BOOT = 5
"""The boot of the rig's real samples, which a client reads on the bus."""
SAID = tuple(key for topic in TOPICS for key in topic.keys)
NAMED = (
    "source/0", "source/5", "source/x", "said/monitor/0", "said/monitor/5", "said/witness/1",
    "said/nobody/0",
)  # fmt: skip
"""Keys at which the holders of tokens say their names."""
ALLOWED_SAID = ("events", "gaps", "health")
"""Topics on which every role may publish."""
ASKED = (
    KEY, "monitor/standing", "monitor/receiver", RING_KEY, "ring/monitor/alarms",
    "ring/monitor/estimates", "ring/monitor/models", "ring/witness/alarms", "ring/nobody/alarms",
    "source/*", "source/0", "said/*/*", "said/monitor/0", DEVICE_KEY, DEVICE_RUN_KEY, SHELF_KEY,
    PAST_KEY,
)  # fmt: skip
_EXTREMES = (0, -1, 7, 10**9, 2**31, 2**53, 2**62, -(2**63), 2**63 - 1)
_TEXTS = ("", "*", "eve", "x" * 5000, "\x00", "ß" * 300, "../../etc/passwd", "[" * 2000)


def kinds(seed: int = 1) -> list[bytes]:
    """The payloads of the 200 kinds."""
    chance = random.Random(seed)
    return [_payload(number, chance) for number in range(KINDS)]


def _payload(number: int, chance: random.Random) -> bytes:
    makers = (
        _forged, _forged, _mutated, _cut, _random_bytes, _question, _wish, _bomb, _token_name,
    )  # fmt: skip
    return makers[number % len(makers)](chance)


def _forged(chance: random.Random) -> bytes:
    return encode(_message(chance))


def _message(chance: random.Random) -> Message:
    seq, t_ns, text = chance.choice(_EXTREMES), chance.choice(_EXTREMES), chance.choice(_TEXTS)
    boot, nan = chance.choice((BOOT, BOOT, 6, *_EXTREMES)), float("nan")
    samples = wave(abs(seq) % 10**6, chance.randint(1, 64), BOOT, abs(t_ns) % 10**18)
    lie = samples.channels[0]
    forged = tuple(
        replace(column, values=column.values + chance.choice((1e3, nan, 1e300)))
        for column in samples.channels
    )
    made: tuple[Message, ...] = (
        replace(samples, boot=boot, seq=seq, channels=forged),
        replace(samples, boot=BOOT, seq=chance.randint(0, 2000), channels=forged),
        replace(samples, device=text, channels=(*forged, replace(lie, name=text))),
        EstimateBlock("rig", boot, seq, np.array([t_ns]), (replace(lie, values=lie.values[:1]),)),
        Gap("rig", boot, seq, chance.choice(_EXTREMES), t_ns, text, text),
        Health(chance.choice(("monitor", "daq", "recorder", text)), t_ns, text, text, {text: nan}),
        Event(text, t_ns, "critical", chance.choice(("FORGED", "CLOCK STEP", text)), text),
        Alarm(
            chance.choice(("dry_friction", "stale", text)), "normal", "info", text, text, "rig",
            boot, seq, t_ns, nan, nan, nan, True, text, seq, "proved",
        ),
        AlarmCommand(
            chance.choice(("*", "stale", "monitor_stale", text)),
            chance.choice(("acknowledge", "reset", "shelve", "unshelve")),
            chance.choice(("ann", text)), t_ns, text, text,
        ),
        RunInfo("bench", t_ns, nan, text, text, text, text),
        ModelChange("rig", boot, seq, t_ns, "ann", text, "a = 1", text, "proved"),
    )  # fmt: skip
    return chance.choice(made)


def _mutated(chance: random.Random) -> bytes:
    data = bytearray(_forged(chance) or b"x")
    for _ in range(chance.randint(1, 8)):
        data[chance.randrange(len(data))] = chance.randrange(256)
    return bytes(data)


def _cut(chance: random.Random) -> bytes:
    data = _forged(chance)
    return data[: chance.randint(0, len(data))]


def _random_bytes(chance: random.Random) -> bytes:
    size = chance.choice((0, 1, 7, 100, 10_000, MAX_PAYLOAD, MAX_PAYLOAD + 1))
    return chance.randbytes(size)


def _question(chance: random.Random) -> bytes:
    return Ask(*(chance.choice((BOOT, *_EXTREMES)) for _ in range(3))).to_bytes()


def _wish(chance: random.Random) -> bytes:
    model = chance.choice(("", "noise = 1000", "sample_rate = 256.0", f"a = {'9' * 5000}"))
    wish = {
        "action": chance.choice(("promote", "rollback", "destroy")), "model": model,
        "user": chance.choice(("ann", "", "x" * 5000)), "text": chance.choice(_TEXTS),
        "proof": chance.choice(("", "{}", '{"nonce": 1}')),
    }  # fmt: skip
    return json.dumps(wish).encode()


def _token_name(chance: random.Random) -> bytes:
    """The name of a token that the sender does not hold."""
    key, run = chance.choice(NAMED), chance.choice((BOOT, *_EXTREMES))
    identity = chance.choice(("", "0" * 32, "f" * 32, "x" * 300))
    return f"rig/bench/{key} {run}/{chance.choice(_EXTREMES)}/{identity}".encode()


def _bomb(chance: random.Random) -> bytes:
    nested = {"action": "promote", "user": "ann", "text": "", "model": "a = " + "[" * 50_000}
    return chance.choice((
        b"[" * 50_000, b'{"a":' * 20_000, b'{"action": ' + b"9" * 5000 + b"}",
        json.dumps(nested).encode(), b"\xff" * 200_000, b"\x0a\xff\xff\xff\xff\x0f",
    ))  # fmt: skip


def everything(payloads: list[bytes]) -> Iterator[tuple[str, str, bytes]]:
    """Each payload at each topic and queryable: "put" or "ask", key, payload."""
    for payload in payloads:
        yield from (("put", key, payload) for key in (*SAID, *NAMED))
        yield from (("ask", key, payload) for key in ASKED)

"""Malformed input for an hour: every target refuses it by one of its own errors, and in time.

Input is mutated from valid examples (`mutations.py`). A crash is any exception that is not a
`RigwatchError`; a hang is above two seconds of the processor's time.
"""

import os
import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import sympy

from benchmarks.malformed.mutations import mutated
from benchmarks.malformed.recordings import block_from, session_readers
from benchmarks.malformed.tables import import_readers
from rigwatch.physics.engine.equations.expression import parse as parse_expression
from rigwatch.wire.device.frame import Frame, FrameDecoder
from rigwatch.wire.device.frame import encode as encode_frame
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import TOPICS, decode, encode
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.session import run_info
from rigwatch.wire.typed_files import find_config, parse
from tools.benchmark_table import Row

LONGEST_S = 2.0


@dataclass(frozen=True)
class Target:
    """A reader of input and valid examples of it."""

    read: Callable[[bytes], object]
    examples: tuple[bytes, ...]


def run(quick: bool) -> list[Row]:
    """Ten seconds for each target, or an hour in all, of the processor's time.

    RIGWATCH_FUZZ_MINUTES says another time, RIGWATCH_FUZZ_ONLY a part of the targets' names.
    """
    minutes = float(os.environ.get("RIGWATCH_FUZZ_MINUTES", "60"))
    with TemporaryDirectory() as folder:
        only = os.environ.get("RIGWATCH_FUZZ_ONLY", "")
        targets = {k: v for k, v in _targets(Path(folder)).items() if only in k}
        seconds = 10.0 if quick else 60.0 * minutes / len(targets)
        return [_row(name, target, seconds) for name, target in targets.items()]


def _row(name: str, target: Target, seconds: float) -> Row:
    chance, count, slowest = random.Random(name), 0, 0.0
    crashes: dict[str, bytes] = {}
    ends = time.process_time() + seconds
    while time.process_time() < ends:
        data, began = mutated(chance, target.examples), time.process_time()
        try:
            target.read(data)
        except RigwatchError:
            pass
        except Exception as error:
            crashes.setdefault(f"{type(error).__name__}: {error}"[:100], data)
        slowest = max(slowest, time.process_time() - began)
        count += 1
    examples = "; ".join(f"{what} by {data[:60]!r}" for what, data in list(crashes.items())[:3])
    return Row(
        f"malformed input, {name}",
        f"{len(crashes)} crashes, slowest {slowest:.2f} s",
        f"0, {LONGEST_S:g} s",
        "",
        f"{count} inputs in {seconds:.0f} s of processor time {examples}",
        passed=not crashes and slowest <= LONGEST_S,
    )


def _targets(folder: Path) -> dict[str, Target]:
    return {
        "frames of a device": Target(lambda d: FrameDecoder().feed(d), _frames()),
        "messages of the bus": Target(_decode_all, _messages()),
        **{name: Target(*one) for name, one in session_readers(folder).items()},
        **{name: Target(*one) for name, one in import_readers(folder).items()},
        "configuration": Target(
            lambda d: parse(d.decode(errors="replace"), RigConfig, "fuzzed.toml"),
            (find_config("demo.toml").read_bytes(),),
        ),
        "expressions": Target(
            lambda d: parse_expression(d.decode(errors="replace"), _NAMES, "fuzzed"),
            (b"F*tanh(v/0.001) + c*v", b"x**3 + 2**10*x - 1e-3*x**0.5", b"k*x*abs(x)/(1 + x**2)"),
        ),
    }


_NAMES = {name: sympy.Symbol(name, real=True) for name in ("F", "v", "c", "x", "k")}


def _frames() -> tuple[bytes, ...]:
    return (b"".join(encode_frame(Frame(7, n, 3906 * n, (n, 2 * n, -n))) for n in range(8)),)


def _messages() -> tuple[bytes, ...]:
    return encode(block_from(0)), encode(run_info("bench", 256.0))


def _decode_all(data: bytes) -> None:
    for line in TOPICS:
        try:
            decode(line.message, data)
        except RigwatchError:
            continue

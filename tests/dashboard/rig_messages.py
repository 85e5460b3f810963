"""A rig that moves, then rubs: what daq and monitor would say, without either of them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rigwatch.wire.messages.message_types import (
    Alarm,
    Column,
    EstimateBlock,
    Health,
    Message,
    SampleBlock,
)

RATE = 256.0
START_NS = 1_790_000_000_000_000_000
SIGNATURE = (1.0, 4.0)
MARKS = {"theta1_signature": 1.0, "theta2_signature": 4.0, "deviation_high": 7.0}
_WINDOW = 1.2  # s, in which the estimates go over to the signature


@dataclass(frozen=True)
class Rig:
    """When friction appears and when the alarms say so [s]."""

    friction_at: float = 4.0
    alarm_after: float = 0.1
    named_after: float = 0.8
    start_ns: int = START_NS

    def messages(self, seconds: float, block: int = 8) -> Iterator[Message]:
        rng = np.random.default_rng(4)
        spoken: set[str] = set()
        for first in range(0, int(seconds * RATE), block):
            seq = np.arange(first, first + block)
            yield self.samples(seq, rng)
            yield self.estimates(seq, rng)
            yield from self.alarms(int(seq[-1]), spoken)
            if first % int(RATE) < block:
                yield self.health(int(seq[-1]))

    def t_ns(self, seq: np.ndarray) -> np.ndarray:
        return self.start_ns + np.round(seq / RATE * 1e9).astype(np.int64)

    def motion(self, seq: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Velocity, modelled acceleration and residual without noise."""
        t = seq / RATE
        rubs = t >= self.friction_at
        model = 14.0 * np.sin(2 * np.pi * 4.0 * t) + 3.0 * np.sin(2 * np.pi * 12.0 * t + 0.4)
        v = -0.55 * np.cos(2 * np.pi * 4.0 * t)
        return v, model, -1.0 * rubs * (2.2 * np.tanh(v / 0.02) + 3.0 * v)

    def samples(self, seq: np.ndarray, rng: np.random.Generator) -> SampleBlock:
        t = seq / RATE
        _, model, residual = self.motion(seq)
        x = -0.0125 * np.sin(2 * np.pi * 4.0 * t)
        channels = (
            Column("voltage", "V", 1.0 * np.sin(2 * np.pi * 4.0 * t + 0.8)),
            Column("position", "m", x + rng.normal(0, 2e-5, len(t))),
            Column("acceleration", "m/s^2", model + residual + rng.normal(0, 0.15, len(t))),
        )
        us = np.round(t * 1e6).astype(np.int64)
        return SampleBlock("rig", 7, int(seq[0]), us, self.t_ns(seq), channels)

    def estimates(self, seq: np.ndarray, rng: np.random.Generator) -> EstimateBlock:
        t = seq / RATE
        _, model, residual = self.motion(seq)
        share = np.clip((t - self.friction_at) / _WINDOW, 0, 1)
        columns = [
            Column("modelled_acceleration", "m/s^2", model),
            Column("residual", "m/s^2", residual + rng.normal(0, 0.15, len(t))),
            Column("change", "m/s^2", residual + rng.normal(0, 0.1, len(t))),
            *_constant("change", "m/s^2", len(t), low=-0.8, high=0.8),
            Column("deviation", "", 0.4 + 30.0 * share),
            Column("armed", "", np.ones(len(t))),
            Column("observable", "", np.ones(len(t))),
        ]
        for name, value in zip(("theta1", "theta2"), SIGNATURE, strict=True):
            theta = value * share + rng.normal(0, 0.02 * value, len(t))
            columns += [
                Column(name, "1", theta),
                *_constant(name, "1", len(t), low=-0.1 * value, high=0.1 * value),
            ]
        return EstimateBlock("rig", 7, int(seq[0]), self.t_ns(seq), tuple(columns))

    def alarms(self, seq: int, spoken: set[str]) -> Iterator[Alarm]:
        t = seq / RATE - self.friction_at
        if t > self.alarm_after and "departure" not in spoken:
            spoken.add("departure")
            yield self.alarm("departure", "unacknowledged", seq, "an estimate left its thresholds")
        if t > self.named_after and "dry_friction" not in spoken:
            spoken.add("dry_friction")
            yield self.alarm("departure", "normal", seq, "an estimate left its thresholds")
            yield self.alarm(
                "dry_friction",
                "unacknowledged",
                seq,
                "dry friction: bearing pressure too low, wear, side load or dirt",
            )

    def alarm(self, name: str, state: str, seq: int, cause: str) -> Alarm:
        return Alarm(
            name=name,
            state=state,  # type: ignore[arg-type]
            severity="error",
            cause=cause,
            guidance="Stop soon. Check the air bearing's supply, then alignment, seals and guides.",
            device="rig",
            boot=7,
            seq=seq,
            t_ns=int(self.t_ns(np.array(seq))),
            value=0.93,
            low=float("nan"),
            high=0.5,
            first_out=True,
            user="",
            onset_seq=seq - 4,
        )

    def health(self, seq: int) -> Health:
        counters = {
            "rate_hz": 256.02,
            "rate_mean_hz": 256.0,
            "rate_worst_hz": 255.4,
            "lost_samples": 0.0,
            "crc_errors": 1.0,
            "latency_ms": 0.9,
        }
        return Health("daq", int(self.t_ns(np.array(seq))), "running", "", counters)


def _constant(name: str, unit: str, n: int, **values: float) -> list[Column]:
    return [Column(f"{name}_{key}", unit, np.full(n, value)) for key, value in values.items()]

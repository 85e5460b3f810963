"""Executes control lines: effects of the plant, faults of the line and the device."""

import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from rigwatch.wire.errors import DeviceError
from sim_plant.serve.line_faults import NAMES, LineFaults
from sim_plant.serve.source import Device

ALIASES = {"friction": "coulomb"}
"""Short names of common effects."""
DONE_S = 2.0
"""Longest wait for the rig's next sample [s]."""


class Effects(Protocol):
    """A plant whose effects can be set while it runs, such as `sim_plant.rig.Rig`."""

    @property
    def effects(self) -> dict[str, float]:
        """Current value of every effect."""

    def set_effect(self, name: str, value: float, over_s: float = 0.0) -> None:
        """Set an effect; raises `ModelError` if there is no such effect."""


class Controlled:
    """A source whose effects are changed between samples, in the thread that simulates.

    Args:
        source: object with `advance(n)`.
        effects: the plant of that source.
    """

    def __init__(self, source: Any, effects: Effects) -> None:
        self._source = source
        self._effects = effects
        self._waiting: deque[tuple[Callable[[], None], threading.Event, list[Exception]]] = deque()

    def advance(self, n: int) -> Any:
        """The next n samples, after the requested changes."""
        while self._waiting:
            act, done, errors = self._waiting.popleft()
            try:
                act()
            except Exception as error:
                errors.append(error)
            done.set()
        return self._source.advance(n)

    def do(self, act: Callable[[], None]) -> None:
        """Run `act` before the next sample; its error is raised here."""
        done, errors = threading.Event(), list[Exception]()
        self._waiting.append((act, done, errors))
        if not done.wait(DONE_S):
            raise DeviceError("the simulated rig does not advance")
        if errors:
            raise errors[0]

    def set(self, name: str, value: float, over_s: float) -> None:
        """Set an effect, or ramp it over some seconds."""
        self.do(lambda: self._effects.set_effect(ALIASES.get(name, name), value, over_s))

    def values(self) -> Mapping[str, float]:
        """Current value of every effect."""
        return self._effects.effects


class Commands:
    """Answers the control lines.

    Args:
        plant: its effects.
        device: counters and clock.
        faults: faults of the line, None if there is no line.
        neutral: value of every effect at which it is absent.
    """

    def __init__(
        self,
        plant: Controlled,
        device: Device,
        faults: LineFaults | None,
        neutral: Mapping[str, float],
    ) -> None:
        self._plant = plant
        self._device = device
        self._faults = faults
        self._neutral = neutral
        self._words: dict[str, Callable[[list[str]], str]] = {
            "set": self._set,
            "clear": self._clear,
            "effects": self._effects,
            "fault": self._fault,
            "heal": self._heal,
            "restart": self._restart,
            "clock": self._clock,
        }

    def answer(self, line: str) -> str:
        """The answer to a line.

        Raises:
            DeviceError: the command is unknown.
            ModelError: there is no such effect.
        """
        word, *rest = line.split() or [""]
        if word not in self._words:
            raise DeviceError(f"{word!r}: expected one of {', '.join(self._words)}")
        return self._words[word](rest)

    def _set(self, rest: list[str]) -> str:
        over = _number(rest[2]) if len(rest) == 3 and rest[1] == "over" else 0.0
        name, equals, value = (rest or [""])[0].partition("=")
        if not equals or len(rest) not in (1, 3):
            raise DeviceError(f"set {' '.join(rest)}: expected set NAME=VALUE [over SECONDS]")
        self._plant.set(name, _number(value), over)
        return f"{name}={value}"

    def _clear(self, _rest: list[str]) -> str:
        changed = [n for n, value in self._plant.values().items() if value != self._neutral[n]]
        for name in changed:
            self._plant.set(name, self._neutral[name], 0.0)
        return ", ".join(changed) or "nothing was set"

    def _effects(self, _rest: list[str]) -> str:
        return " ".join(f"{name}={value:g}" for name, value in self._plant.values().items())

    def _fault(self, rest: list[str]) -> str:
        if self._faults is None:
            raise DeviceError("line faults are for a rig that is served on a serial line")
        name, count = (*rest, "", "0")[0], (*rest, "", "0")[1] or "0"
        if name not in NAMES:
            raise DeviceError(f"fault {name!r}: expected one of {', '.join(NAMES)}")
        self._faults.start(name, int(_number(count)))
        return name

    def _heal(self, _rest: list[str]) -> str:
        for name in NAMES if self._faults else ():
            self._faults.stop(name)  # type: ignore[union-attr]
        return "the line is sound"

    def _restart(self, _rest: list[str]) -> str:
        self._plant.do(self._device.restart)
        return f"boot {self._device.boot:08x}"

    def _clock(self, rest: list[str]) -> str:
        seconds = _number((rest or [""])[0])
        self._plant.do(lambda: self._device.jump_clock(seconds))
        return f"clock {seconds:+g} s"


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise DeviceError(f"{text!r}: expected a number") from None

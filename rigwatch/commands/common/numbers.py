"""Numbers of options: what is no number of the kind is refused in a sentence."""

import argparse
import math
from collections.abc import Callable


def number(least: float, most: float = math.inf, *, above: bool = False) -> Callable[[str], float]:
    """The type of an option that takes a finite number from `least`, or from `above` it, on."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and least <= value <= most and not (above and value == least)):
            raise _refused(text, "a number", least, most, above=above)
        return value

    return read


def whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """The type of an option that takes a whole number from `least` to `most`."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if value < least or (most is not None and value > most):
            raise _refused(text, "a whole number", least, math.inf if most is None else most)
        return value

    return read


POSITIVE, PORT = number(0, above=True), whole(0, 65535)


def _refused(
    text: str, kind: str, least: float, most: float, *, above: bool = False
) -> argparse.ArgumentTypeError:
    lower = f"above {least:g}" if above else f"of at least {least:g}"
    upper = f" and at most {most:g}" if math.isfinite(most) else ""
    return argparse.ArgumentTypeError(f"found {text!r}, expected {kind} {lower}{upper}")

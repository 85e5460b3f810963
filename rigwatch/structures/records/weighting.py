"""How much each sample of a record counts (thesis 4.6).

uniform          w = 1
exponential:τ    w = exp(−t/τ): early samples count more; with τ < 0 late ones (Laguerre)
jacobi:a,b       w = (1 − s)ᵃ·(1 + s)ᵇ, s from −1 to 1 over the record: a > 0 lets the end count
                 less, b > 0 the start
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError


def weights(kind: str, time: FloatArray) -> FloatArray:
    """Weights of the squared errors at `time` [s], largest 1; shape (n,).

    Raises:
        ModelError: `kind` is none of the above.
    """
    name, _, numbers = kind.partition(":")
    try:
        values = [float(number) for number in numbers.split(",")] if numbers else []
    except ValueError:
        raise _unknown(kind) from None
    if name == "uniform" and not values:
        return np.ones_like(time)
    if name == "exponential" and len(values) == 1 and values[0] != 0:
        return _scaled(np.exp(-(time - time[0 if values[0] > 0 else -1]) / values[0]))
    if name == "jacobi" and len(values) == 2 and min(values) >= 0:
        place = 2.0 * (time - time[0]) / max(time[-1] - time[0], 1e-300) - 1.0
        return _scaled((1.0 - place) ** values[0] * (1.0 + place) ** values[1])
    raise _unknown(kind)


def _scaled(found: FloatArray) -> FloatArray:
    return np.asarray(found / found.max())


def _unknown(kind: str) -> ModelError:
    return ModelError(
        f"weighting: found {kind!r}, expected uniform, exponential:SECONDS or jacobi:A,B"
    )

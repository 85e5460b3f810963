"""A mass pushed by the piston of an actuator whose pressure follows a voltage, in two variants.

On one machine the motion does not change the pressure; on the other it does, and a controller
drives it back. How fast the pressure follows is known: else a stiffer spring would describe the
healthy motion as well. Voltages are held from sample to sample, so that the response is exact.
"""

import numpy as np
from scipy.signal import cont2discrete, dlsim

from rigwatch.wire.arrays import FloatArray

RATE, MASS, AREA, SPRING, DAMPER = 256.0, 0.5, 1e-3, 300.0, 4.0
SLOW, GAIN, STIFF = 25.0, 2e4, 2e5
MODEL = """
name = "pushed"
summary = "A mass and a piston."
hold = "zero"

[inputs.voltage]
unit = "V"

[quantities]
acceleration = { expression = "(A*p - c*v - k*x + load)/m", unit = "m/s^2" }

[states.x]
unit = "m"
derivative = "v"
measured = "position"

[states.v]
unit = "m/s"
derivative = "acceleration"
rate_of = "position"

[states.p]
unit = "Pa"
derivative = "w*(G*drive - p)"

[parameters]
m = { value = 0.5, unit = "kg", low = 0.01, fixed = true }
A = { value = 1e-3, unit = "m^2", low = 1e-5, fixed = true }
k = { value = 200.0, unit = "N/m", low = 0.0, high = 2000.0, kept = true }
c = { value = 2.0, unit = "N s/m", low = 0.0, high = 50.0, kept = true }
w = { value = 25.0, unit = "1/s", low = 1.0, high = 1000.0, fixed = true }
G = { value = 1.5e4, unit = "Pa/V", low = 1e2, high = 1e6, kept = true }

[outputs.position]
unit = "m"
expression = "x"

[outputs.acceleration]
unit = "m/s^2"
expression = "acceleration"

[ports.drive]
kind = "actuator"
signal = "voltage"

[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }

[variants.compressed]
physics = "The motion changes the pressure, which a controller drives back."
parameters.B = { value = 1e4, unit = "Pa/m", low = 0.0, high = 1e7, kept = true }
states.p = { unit = "Pa", derivative = "w*(G*drive - p) - B*v" }

[variants.prompt]
physics = "The pressure is hardly later than the voltage."
parameters.w = { value = 1000.0, unit = "1/s", low = 1.0, high = 1000.0, fixed = true }
"""


def pushed(
    volts: FloatArray,
    compressed: float,
    seed: int,
    *,
    spring: float = SPRING,
    damper: float = DAMPER,
    noise: float = 0.02,
) -> dict[str, FloatArray]:
    """The machine's channels under a held voltage.

    Args:
        volts: shape (n,).
        compressed: by how much the motion changes the pressure [Pa/m].
        seed: of the sensors' noise.
        spring: [N/m].
        damper: [N s/m].
        noise: of the accelerometer [m/s^2].
    """
    a = np.array(
        [
            [0.0, 1.0, 0.0],
            [-spring / MASS, -damper / MASS, AREA / MASS],
            [0.0, -compressed, -SLOW],
        ]
    )
    b = np.array([[0.0], [0.0], [SLOW * GAIN]])
    step = cont2discrete((a, b, np.eye(3), np.zeros((3, 1))), 1.0 / RATE, "zoh")
    found = dlsim(step, volts)[1]
    random = np.random.default_rng(seed)
    return {
        "voltage": volts,
        "position": found[:, 0] + 2e-6 * random.standard_normal(volts.size),
        "acceleration": found @ a[1] + noise * random.standard_normal(volts.size),
    }

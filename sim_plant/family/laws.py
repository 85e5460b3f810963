"""Numbers of the laws of a member; the kernel switches on them."""

from enum import IntEnum


class Flow(IntEnum):
    """Law of the flow through a restriction."""

    ISO_6358 = 0
    ORIFICE = 1
    WEYMOUTH = 2
    BLEND = 3
    ISENTROPIC = 4
    CAPILLARY = 5


class Heat(IntEnum):
    """Heat law of the gas in a chamber."""

    ISOTHERMAL = 0
    POLYTROPIC = 1
    ENERGY = 2


class Stage(IntEnum):
    """How the valve acts on the chambers."""

    PRESSURE = 0
    BRIDGE = 1
    REGULATED = 2


class Friction(IntEnum):
    """Law of dry friction."""

    TANH = 0
    KARNOPP = 1
    LUGRE = 2
    STRIBECK = 3
    DAHL = 4

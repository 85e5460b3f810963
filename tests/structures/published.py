"""Figures of Tables 4.1 to 4.7 as printed in W. B. Dunbar, Damage Detection in Dynamic Systems with
Nonlinearities, MSc thesis, UC San Diego, 1999. Order: k4, k1, α·k1 at mass 6 of the Kabe antenna.
"""

from dataclasses import dataclass
from typing import Any

NAMES = ["k4_46", "k1_6", "k1_6_cubic"]
Three = tuple[float, float, float]


@dataclass(frozen=True)
class Published:
    """One row.

    Attributes:
        where: table and row.
        true, guess: of the three unknowns.
        load: in the words of a structure file.
        h: time step [s].
        iterations: as printed.
        end: what it converged to, as printed; empty where it failed.
        fails: whether the thesis reports no convergence.
        misprint: which of the three printed first figures is not judged, and why.
    """

    where: str
    true: Three
    guess: Three
    load: dict[str, Any]
    h: float = 0.01
    iterations: tuple[Three, ...] = ()
    end: tuple[Three, ...] = ()
    fails: bool = False
    misprint: tuple[int, str] | None = None


SINES = [
    {"amplitude": 350.0, "omega": 10.0},
    {"amplitude": 300.0, "omega": 700.0},
    {"amplitude": 250.0, "omega": 800.0},
    {"amplitude": 200.0, "omega": 200.0},
]
LOW, MIDDLE, HIGH, TOP = (50.0, 1300.0, 145.0), (150.0, 1300.0, 320.0), (150.0, 750.0, 1700.0), (
    150.0, 750.0, 7500.0,
)  # fmt: skip
FIVE, FIVE_LARGE = {"node": "5", "step": 1000.0}, {"node": "5", "step": 4000.0}
SIX, SIX_LARGE = {"node": "6", "step": 1000.0}, {"node": "6", "step": 4000.0}
SIX_SINES = {"node": "6", "sines": SINES}


def _true(alpha: float) -> Three:
    return (100.0, 1000.0, 1000.0 * alpha)


ROWS: list[Published] = [
    Published(
        "4.1 α 0.1",
        _true(0.1),
        LOW,
        FIVE,
        0.01,
        ((100.5, 997.1, 101.4),),
        ((99.99, 1000.0, 101.9),),
    ),
    Published(
        "4.1 α 0.5",
        _true(0.5),
        MIDDLE,
        FIVE,
        0.01,
        ((99.59, 997.2, 506.1),),
        ((99.98, 1000.0, 509.7),),
    ),
    Published(
        "4.1 α 2.5",
        _true(2.5),
        HIGH,
        FIVE,
        0.01,
        ((99.71, 1002.0, 2548.0),),
        ((100.0, 1000.0, 2543.0),),
    ),
    Published(
        "4.1 α 10",
        _true(10.0),
        TOP,
        FIVE,
        0.01,
        ((98.80, 996.0, 10520.0),),
        ((100.1, 1000.0, 10140.0),),
    ),
    Published(
        "4.2 α 0.1",
        _true(0.1),
        LOW,
        FIVE_LARGE,
        0.01,
        ((100.5, 998.9, 101.4),),
        ((100.0, 1000.0, 101.7),),
    ),
    Published(
        "4.2 α 0.5",
        _true(0.5),
        MIDDLE,
        FIVE_LARGE,
        0.01,
        ((99.63, 995.7, 507.4),),
        ((100.1, 1000.0, 507.3),),
    ),
    Published(
        "4.2 α 2.5",
        _true(2.5),
        HIGH,
        FIVE_LARGE,
        0.01,
        ((99.37, 999.5, 2574.0),),
        ((100.1, 1002.0, 2532.0),),
    ),
    Published(
        "4.2 α 10",
        _true(10.0),
        TOP,
        FIVE_LARGE,
        0.01,
        ((99.50, 1001.0, 10250.0),),
        ((100.1, 1002.0, 10140.0),),
    ),
    Published(
        "4.3 α 0.1",
        _true(0.1),
        LOW,
        SIX,
        0.01,
        ((100.5, 1007.0, 95.02),),
        ((100.0, 1003.0, 99.21),),
    ),
    Published(
        "4.3 α 0.5",
        _true(0.5),
        MIDDLE,
        SIX,
        0.01,
        ((99.41, 1014.0, 493.9),),
        ((101.4, 1002.0, 497.8),),
    ),
    Published(
        "4.3 α 2.5",
        _true(2.5),
        HIGH,
        SIX,
        0.01,
        ((99.50, 1005.0, 2550.0),),
        ((99.83, 1070.0, 2440.0),),
    ),
    Published("4.3 α 10", _true(10.0), TOP, SIX, 0.01, ((99.50, 1066.0, 10140.0),), (), fails=True),
    Published(
        "4.4 h 0.01",
        _true(0.1),
        LOW,
        SIX,
        0.01,
        ((100.5, 1007.0, 95.02),),
        ((100.0, 1003.0, 99.21),),
    ),
    Published(
        "4.4 h 0.03",
        _true(0.1),
        LOW,
        SIX,
        0.03,
        ((108.1, 1023.0, 61.40),),
        ((100.3, 1030.0, 88.9),),
    ),
    Published("4.4 h 0.04", _true(0.1), LOW, SIX, 0.04, ((58.5, 321.3, 235.9),), (), fails=True),
    Published(
        "4.5 step, h 0.01", _true(10.0), TOP, SIX, 0.01, ((99.5, 1066.0, 10139.0),), (), fails=True
    ),
    Published(
        "4.5 step, h 0.001",
        _true(10.0),
        TOP,
        SIX,
        0.001,
        ((99.99, 1066.0, 10001.6),),
        ((100.0, 1002.1, 9996.8),),
        misprint=(1, "the printed k1 of 1066 is that of the row above; the second is 1000.66"),
    ),
    Published(
        "4.5 sines, h 0.01",
        _true(10.0),
        TOP,
        SIX_SINES,
        0.01,
        ((100.3, 998.0, 9737.0),),
        ((99.63, 974.8, 10010.0),),
    ),
    Published("4.5 sines, h 0.015", _true(10.0), TOP, SIX_SINES, 0.015, (), (), fails=True),
    Published(
        "4.6 h 0.01",
        _true(0.1),
        LOW,
        SIX_LARGE,
        0.01,
        ((100.4, 1119.0, 92.42),),
        ((99.96, 1049.0, 97.97),),
    ),
    Published(
        "4.6 h 0.005", _true(0.1), (50.0, 750.0, 7500.0), SIX_LARGE, 0.005, (), (), fails=True
    ),
    Published(
        "4.6 h 0.0005",
        _true(0.1),
        (50.0, 750.0, 7500.0),
        SIX_LARGE,
        0.0005,
        ((100.0, 1012.0, 99.05),),
        ((100.0, 1000.0, 100.0),),
    ),
]
"""Tables 4.1 to 4.6."""

NOISE: dict[float, Three] = {
    0.0: (99.99, 1000.0, 101.9),
    0.05: (99.96, 1000.0, 102.1),
    0.10: (99.92, 1001.0, 102.2),
    0.20: (98.82, 1002.0, 102.6),
    0.50: (98.07, 1009.0, 170.4),
}
"""Table 4.7, after 25 iterations."""

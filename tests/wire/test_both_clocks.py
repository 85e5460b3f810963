"""A process interrupted between two readings of its clocks sees no step of the wall clock."""

from rigwatch.wire.host.both_clocks import both_clocks

WALL_NS, SECOND = 1_800_000_000 * 10**9, 10**9


def test_an_interruption_between_the_readings_is_no_step() -> None:
    now, readings = 0, 0

    def steady() -> int:
        return now

    def wall() -> int:
        nonlocal now, readings
        at, readings = WALL_NS + now, readings + 1
        now += 3 * SECOND if readings == 1 else 1000
        return at

    at, steadily = both_clocks(wall, steady)
    assert abs((at - steadily) - WALL_NS) <= 1000
    assert readings == 2


def test_without_an_interruption_each_clock_is_read_once() -> None:
    assert both_clocks(lambda: WALL_NS, lambda: 5) == (WALL_NS, 5)

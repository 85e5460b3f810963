"""Clocks that are set while the monitor runs, and clocks of two machines that differ by hours."""

from pathlib import Path

import pytest

from monitor.alarms import Occasion
from monitor.process import loop
from monitor.process.rig_time import RigTime
from rigwatch.wire.bus.commands.command_check import signed
from rigwatch.wire.messages.message_types import AlarmCommand
from rigwatch.wire.messages.topics import ALARMS, COMMANDS, EVENTS
from tests.bus.publisher import wave
from tests.monitor_process.test_process import Bench

SECOND, HOUR, DAY = 10**9, 3600 * 10**9, 86_400 * 10**9
BEGIN = 1_700_000_000 * SECOND


class Clock:
    """The machine's two clocks, set by hand."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.wall, self.steady = BEGIN, 10**15
        monkeypatch.setattr(loop, "both_clocks", lambda: (self.wall, self.steady))

    def go(self, ns: int) -> None:
        self.wall += ns
        self.steady += ns


@pytest.mark.parametrize(
    ("samples_ahead", "set_back"),
    [(0, 0), (DAY, 0), (0, DAY), (DAY, DAY)],
    ids=["no clock", "daq's a day ahead", "this set back", "daq starts again by the right clock"],
)
def test_a_shelf_lasts_eight_hours_whatever_the_clocks_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, samples_ahead: int, set_back: int
) -> None:
    clock, numbers = Clock(monkeypatch), iter(range(10**6))
    bench = Bench(tmp_path)
    boot, ahead = 7, samples_ahead

    def turn(hours: float) -> list[str]:
        """What the alarm says once a sample has come after so much time."""
        clock.go(int(hours * HOUR))
        seq = next(numbers)
        bench.send(wave(seq, 1, boot, clock.wall + ahead - seq * 3_906_250))
        bench.turn()
        return [one.state for one in bench.heard[ALARMS].drain() if one.name == "disk"]

    turn(0.0)
    at = Occasion("rig", 7, 0, clock.wall)
    bench.monitor.say(bench.monitor.rig.alarms.report("disk", at, active=True))
    bench.monitor._reports = lambda _: iter(())  # type: ignore[method-assign]
    order = AlarmCommand("disk", "shelve", "ann", clock.wall, "known")
    bench.observer.publish(COMMANDS, signed(bench.observer, order))
    assert turn(0.0)[-1] == "normal"
    assert turn(2.0) == []
    clock.wall -= set_back
    if set_back:
        boot, numbers, ahead = 8, iter(range(10**6)), 0
    assert turn(5.5) == []
    assert turn(1.0) == ["unacknowledged"]
    codes = [one.code for one in bench.heard[EVENTS].drain()]
    assert codes.count("alarm_shelved") == codes.count("alarm_unshelved") == 1
    bench.monitor.close()


def test_a_machine_set_back_while_no_sample_comes_goes_on_by_its_steady_clock() -> None:
    time = RigTime(BEGIN, 0)
    assert time.set_back(BEGIN + SECOND - DAY, SECOND) == 0
    assert time.now(2 * SECOND) == BEGIN + 2 * SECOND
    # Samples that are read late, by a monitor that catches up, change nothing.
    assert time.set_back(BEGIN + 3 * SECOND, 3 * SECOND, BEGIN - HOUR) == 0
    assert time.now(4 * SECOND) == BEGIN + 4 * SECOND

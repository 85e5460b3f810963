"""No client fills the readers of a topic whose messages are few, and none keeps out another."""

import time
from pathlib import Path

import pytest

from rigwatch.recorder.process import Recorder, describe_run
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.messages import EVENTS, HEALTH, Event
from rigwatch.wire.ordering.sender_rates import BURST, MOST_SENDERS, OVERHEAD, RATE, SenderRates
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from tests.bus.rig import TestRig

LARGE = "x" * 4000
FLOOD = 4000
"""Events of 4 kB that are sent at once: four times what an account holds."""


def test_who_sends_little_is_never_refused_and_a_flood_is_bounded() -> None:
    rates, taken = SenderRates(), 0
    for n in range(100_000):
        now = n / 1000.0
        assert n % 10 or rates.admits("daq", 300, now), "a hundred messages a second"
        taken += 1000 * rates.admits("eve", 1000, now)
    assert BURST < taken * (1 + OVERHEAD / 1000) <= BURST + RATE * 100.0
    assert rates.refused == 100_000 - taken / 1000


def test_identities_that_are_made_up_share_one_account_and_are_forgotten() -> None:
    rates = SenderRates()
    taken = sum(rates.admits(f"eve-{n}", 100_000, 0.0) for n in range(10_000))
    assert taken <= MOST_SENDERS + BURST / 100_000
    assert not rates.admits("late", 100_000, 0.0)
    assert rates.admits("late", 100_000, 2.0)


@pytest.mark.parametrize("flooded", [False, True])
def test_a_flood_of_events_does_not_fill_a_recording(tmp_path: Path, flooded: bool) -> None:
    rig = TestRig(tmp_path, f'\n[recorder]\nfolder = "{tmp_path}/sessions"\n')
    network, config = MemoryNetwork(), load_rig(rig.path)
    daq, eve = network.bus("bench", "daq"), network.bus("bench", "eve")
    told = network.bus("bench", "observer").subscribe(HEALTH)
    recorder = Recorder(config, describe_run(rig.path, config), network.bus("bench", "recorder"))
    began = time.monotonic()
    for number in range(FLOOD):
        if flooded:
            eve.publish(EVENTS, Event("eve", 1, "info", "FLOOD", LARGE))
        if number % 100 == 0:
            daq.publish(EVENTS, Event("daq", number, "info", "REAL", "a real one"))
            recorder.turn(number / 1e4, time.time_ns())
    recorder.turn(10.0, time.time_ns())
    (*_, health) = [one for one in told.drain() if one.source == "recorder"]
    recorder.close(10.0, time.time_ns())
    session = open_session(recorder.store.folder)
    found = [item.message for item in session.messages(["events"])]
    real = [one.t_ns for one in found if isinstance(one, Event) and one.code == "REAL"]
    assert real == list(range(0, FLOOD, 100))
    kept = sum(isinstance(one, Event) and one.code == "FLOOD" for one in found)
    assert kept * 4000 <= BURST + RATE * (time.monotonic() - began)
    assert kept + health.counters["refused_messages"] == (FLOOD if flooded else 0)

"""A structure that is watched on the rig of a monitor: what each says is kept apart."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.archive.second_aggregates import SecondAggregates
from rigwatch.browser.rig.live_view import LiveView
from rigwatch.dashboard.board.facts import Facts
from rigwatch.recorder.past import BlockStream
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.exchange import export_session
from rigwatch.wire.messages import ESTIMATES, Column, EstimateBlock, Gap, cut
from rigwatch.wire.rig_config import WitnessSection
from rigwatch.wire.session import SessionWriter, open_session, run_info
from rigwatch.witness.process import Witness

COUNT, STEP = 600, 10_000_000
MONITOR = ("armed", "residual", "theta1")
STRUCTURE = ("residual_x1", "statistic")


def estimates(names: tuple[str, ...], value: float) -> EstimateBlock:
    columns = tuple(Column(name, "", np.full(COUNT, value)) for name in names)
    return EstimateBlock("rig", 7, 0, np.arange(COUNT) * STEP, columns)


def in_turns(size: int) -> list[EstimateBlock]:
    """What both said, the structure a little later than the monitor."""
    of_monitor, of_structure = estimates(MONITOR, 1.0), estimates(STRUCTURE, 2.0)
    said = []
    for first in range(0, COUNT + size, size):
        said += [cut(of_monitor, first, first + size)] if first < COUNT else []
        said += [cut(of_structure, first - size, first)] if first else []
    return said


def numbers(blocks: list[EstimateBlock], name: str) -> list[int]:
    """The samples of which a column is there, in order."""
    return [
        block.seq + k
        for block in blocks
        for column in block.columns
        if column.name == name
        for k in range(len(block))
    ]


@pytest.mark.parametrize("repeated", [False, True])
@pytest.mark.parametrize("flushed", [1, 1000])
def test_a_recording_gives_each_estimate_of_both_once(
    tmp_path: Path, flushed: int, *, repeated: bool
) -> None:
    said, path = in_turns(10), tmp_path / "both.mcap"
    with SessionWriter(path, run_info("bench", 100.0)) as writer:
        for number, block in enumerate(said + said[-20:] if repeated else said):
            writer.write(block)
            if number % flushed == 0:
                writer.flush()
    found = list(open_session(path).estimates())
    for name in (*MONITOR, *STRUCTURE):
        assert numbers(found, name) == list(range(COUNT))
    if flushed > 1:
        assert len(found) == 2, "those of each stand together"


@pytest.mark.parametrize(("parts", "columns"), [(slice(None), MONITOR), (slice(1, 2), STRUCTURE)])
def test_an_export_has_the_estimates_of_one(
    tmp_path: Path, parts: slice, columns: tuple[str, ...]
) -> None:
    said = [estimates(MONITOR, 1.0), estimates(STRUCTURE, 2.0)][parts]
    with SessionWriter(tmp_path / "both.mcap", run_info("bench", 100.0)) as writer:
        for block in reversed(said):
            writer.write(block)
    made = export_session(open_session(tmp_path / "both.mcap"), tmp_path / "x.csv", estimates=True)
    assert made.rows == COUNT
    assert made.columns[-len(columns) :] == tuple(f"{name} []" for name in columns)


def test_figures_per_second_are_of_both() -> None:
    kept = SecondAggregates()
    for block in in_turns(7):
        kept.add(block)
    counts = dict.fromkeys((*MONITOR, *STRUCTURE), 0)
    for _, table in kept.days():
        names = [name for name, times in table["name"] for _ in range(times)]
        for name, count in zip(names, table["count"].tolist(), strict=True):
            counts[name] += count
    assert counts == dict.fromkeys(counts, COUNT)


def test_a_gap_is_filled_with_those_of_both() -> None:
    said, stream = in_turns(10), BlockStream()
    before, missing, behind = said[:20], said[20:60], said[60:]
    got = stream.add(before)
    got += stream.add([Gap("monitor", 7, 100, 290, 0, "recorder", "", "estimates"), *behind])
    got += stream.fill([*before[-2:], *missing, *behind[:2]])
    got += stream.end(answered=True)
    blocks = [one for one in got if isinstance(one, EstimateBlock)]
    for name in (*MONITOR, *STRUCTURE):
        assert sorted(numbers(blocks, name)) == list(range(COUNT))


def test_a_structure_does_not_hide_that_the_monitor_is_silent() -> None:
    network = MemoryNetwork()
    witness = Witness(WitnessSection(), network.bus("bench", "witness"), 0.0)
    bus, now = network.bus("bench", "structure"), 0.0
    while now < 40.0:
        now += 0.1
        bus.publish(ESTIMATES, cut(estimates(STRUCTURE, 2.0), 0, 1))
        witness.turn(now, round(now * 1e9))
    assert witness._stale.holds


def test_what_a_structure_says_is_nothing_of_the_monitors_on_a_page_or_a_screen() -> None:
    view = LiveView(100.0)
    view.take(cut(estimates(MONITOR, 1.0), 0, 10), 1.0)
    view.take(cut(estimates(STRUCTURE, 2.0), 0, 10), 1.0)
    _, signals = view.signals(0)
    assert signals["signals"]["estimates"]["lines"].keys() == {"residual", "theta1"}
    assert view._figures == {"armed": 1.0}
    view.take(cut(estimates(STRUCTURE, 2.0), 0, 10), 100.0)
    assert not view._armed(100.0)


def test_a_screen_tells_that_no_estimates_of_the_monitor_come() -> None:
    facts = Facts("bench")
    facts._unjudged, facts._unjudged_ns = 5, 10**9
    facts.see_estimates(cut(estimates(STRUCTURE, 2.0), 0, 10))
    assert facts._unjudged == 5
    facts.see_estimates(cut(estimates(MONITOR, 1.0), 0, 10))
    assert facts._unjudged == 0

"""Rigs that are judged together: each as if alone, to the last bit, whatever others do."""

from collections.abc import Iterator
from dataclasses import replace

import msgspec
import numpy as np

from monitor.model.model_file import RigModel
from monitor.pipeline import RigMonitor, judge_alone, judge_together, ready_of
from rigwatch.wire.messages import SampleBlock, cut, encode
from rigwatch.wire.messages import quality_flags as quality
from tests.monitor.monitor_rig import OTHER_SINE, SINE, block, friction, model, run

SIZE = 9
SECONDS = 12.0


def healthy_then_friction() -> SampleBlock:
    return block(run(SINE, SECONDS, friction(9.0)))


def with_bad_readings() -> SampleBlock:
    """Flags, readings that are none, a clock that jumps, and clipped peaks."""
    channels = run(SINE, SECONDS, seed=2)
    channels["acceleration"][1200:1202] = np.nan
    channels["acceleration"][1500:1700] = np.nan
    top = np.quantile(channels["position"], 0.9)
    channels["position"][2400:] = np.minimum(channels["position"][2400:], top)
    whole = block(channels)
    whole.device_us[2000:] += 5_000_000
    flagged = np.zeros(len(whole), np.uint8)
    flagged[900:903] = quality.SPIKE
    voltage = replace(whole.channels[0], quality=flagged)
    return replace(whole, channels=(voltage, *whole.channels[1:]))


def that_starts_anew() -> SampleBlock:
    return block(run(OTHER_SINE, SECONDS, seed=3))


def pieces_of(whole: SampleBlock, lost: set[int], again: int) -> Iterator[SampleBlock]:
    """Blocks of one length: some lost, some sent twice, from a certain one on of another boot."""
    for number in range(len(whole) // SIZE):
        at = number - (number in {30, 31})  # the same block once more
        if at in lost:
            yield cut(whole, 0, 0)
            continue
        part = cut(whole, at * SIZE, (at + 1) * SIZE)
        yield replace(part, boot=2, seq=part.seq - again * SIZE) if again <= number else part


def clipping_model() -> RigModel:
    known = model()
    noise = msgspec.structs.replace(known.noise, repeat=(1.0, 0.02, 0.02))
    return msgspec.structs.replace(known, noise=noise)


def test_each_rig_gets_what_it_gets_alone() -> None:
    model_of = (clipping_model(), clipping_model(), model())
    rigs = [
        list(pieces_of(healthy_then_friction(), {100}, 10**6)),
        list(pieces_of(with_bad_readings(), {50, 150, 151, 152, 153, 154, 155}, 10**6)),
        list(pieces_of(that_starts_anew(), {60}, 200)),
    ]
    alone = [RigMonitor(known) for known in model_of]
    among = [RigMonitor(known) for known in model_of]
    together, said = [0, 0, 0], [0, 0, 0]
    for blocks in zip(*rigs, strict=True):
        ready = [ready_of(rig, part) for rig, part in zip(among, blocks, strict=True)]
        finishes = iter(judge_together([one for one in ready if one]))
        for n, part in enumerate(blocks):
            finish = next(finishes) if ready[n] else None
            together[n] += finish is not None
            single, mine = alone[n].judge(part), finish() if finish else among[n].judge(part)
            assert (single is None) == (mine is None)
            if single is None or mine is None:
                continue
            assert encode(mine[0]) == encode(single[0])
            announced = alone[n].announce(*single)
            assert repr(among[n].announce(*mine)) == repr(announced)
            said[n] += len(announced)
    count = len(rigs[0])
    assert all(0.5 * count < taken < count - 4 for taken in together)
    assert min(said) > 0


def test_a_rig_by_itself_is_judged_by_the_kernel_with_the_same_results() -> None:
    plain, rig = RigMonitor(clipping_model()), RigMonitor(clipping_model())
    for part in pieces_of(with_bad_readings(), {50, 150, 151}, 10**6):
        single, mine = plain.judge(part), judge_alone(rig, part)
        assert (single is None) == (mine is None)
        if single is not None and mine is not None:
            assert encode(mine[0]) == encode(single[0])
            assert repr(rig.announce(*mine)) == repr(plain.announce(*single))

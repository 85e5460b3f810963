"""A stranger reports losses that did not happen: a complete recording stays complete."""

import time
from pathlib import Path

from rigwatch.recorder.process import Recorder, describe_run
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.messages import GAPS, SAMPLES, Gap
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from rigwatch.wire.session.summary import summarise
from tests.bus.publisher import wave
from tests.bus.rig import TestRig
from tests.waiting import eventually

BOOT = 7


def gap(reporter: str, first: int, last: int, boot: int = BOOT, topic: str = "") -> Gap:
    return Gap("rig", boot, first, last, time.time_ns(), reporter, "lost", topic)


def test_a_headquarters_counts_reports_of_the_sites_recorder_and_none_in_its_name(
    tmp_path: Path,
) -> None:
    rig = TestRig(tmp_path, f'\n[recorder]\nfolder = "{tmp_path}/far"\nremote = true\n')
    network, config = MemoryNetwork(), load_rig(rig.path)
    daq, eve, site = (network.bus("bench", name) for name in ("daq", "eve", "recorder"))
    ring = SampleRing(daq, 1024)
    far = Recorder(config, describe_run(rig.path, config), network.bus("bench", "headquarters"))
    block = wave(0, 64, BOOT, time.time_ns())
    ring.add(block)
    daq.publish(SAMPLES, block)
    for topic in ("", "alarms"):
        eve.publish(GAPS, gap("recorder", 64, 9999, topic=topic))
        site.publish(GAPS, gap("recorder", 64, 66, topic=topic))

    def taken() -> bool:
        far.turn(time.monotonic(), time.time_ns())
        return far.feed.samples == 64 and far.feed.foreign_gaps == 2

    eventually(taken, "the stranger's are refused")
    far.close(time.monotonic(), time.time_ns())
    summary = summarise(open_session(far.store.folder))
    (device,) = summary.devices
    assert (device.samples, device.missing) == (64, 3)
    assert summary.lost_messages == {"alarms": 3}


def test_reports_count_that_come_from_whom_they_name_and_no_others(tmp_path: Path) -> None:
    rig = TestRig(tmp_path, f'\n[recorder]\nfolder = "{tmp_path}/sessions"\n')
    network, config = MemoryNetwork(), load_rig(rig.path)
    daq, eve, monitor = (network.bus("bench", name) for name in ("daq", "eve", "monitor"))
    ring = SampleRing(daq, 1024)
    monitor.announce()
    recorder = Recorder(config, describe_run(rig.path, config), network.bus("bench", "recorder"))
    for seq in range(0, 256, 16):
        block = wave(seq, 16, BOOT, time.time_ns())
        ring.add(block)
        daq.publish(SAMPLES, block)

    def turned() -> bool:
        recorder.turn(time.monotonic(), time.time_ns())
        return recorder.feed.samples == 256

    eventually(turned, "all samples")
    forged = [gap(name, 256, 9999) for name in ("daq/rig", "monitor", "recorder", "headquarters")]
    forged += [gap("daq/rig", 0, -1, boot=8), gap("recorder", 3, 5, topic="alarms")]
    forged += [gap("headquarters", 3, 5, topic="alarms")]
    for one in [*forged, gap("eve", 256, 9999), gap("eve", 0, -1)]:
        eve.publish(GAPS, one)
    daq.publish(GAPS, gap("daq/rig", 256, 259))
    daq.publish(GAPS, gap("daq/rig", 0, -1, boot=8))
    monitor.publish(GAPS, gap("monitor", 258, 263))
    # In the recorder's own name nothing is taken from the bus at all.
    foreign = sum(one.reporter != "recorder" for one in forged)

    def refused() -> bool:
        recorder.turn(time.monotonic(), time.time_ns())
        return recorder.feed.foreign_gaps == foreign

    eventually(refused, "their senders are not who they say")
    recorder.close(time.monotonic(), time.time_ns())
    summary = summarise(open_session(recorder.store.folder))
    (device,) = summary.devices
    assert (device.samples, device.missing) == (256, 8), "what daq and monitor have said"
    assert summary.unknown_ends == 1, "of a boot of which nothing came, as daq has said"
    assert summary.lost_messages == {}
    told = [item.message for item in open_session(recorder.store.folder).messages(["gaps"])]
    assert sum(isinstance(one, Gap) and one.reporter == "eve" for one in told) == 2, "recorded"

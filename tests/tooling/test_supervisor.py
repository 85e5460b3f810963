"""Real processes under the supervisor: killed, stopped dead, starved, stalled, ended, stopped."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from rigwatch.supervisor import supervisor
from rigwatch.supervisor.child import die_with
from rigwatch.supervisor.plan import ProcessPlan
from rigwatch.supervisor.supervisor import ProcessEvent, Supervisor, how_it_ended
from rigwatch.supervisor.vitals import Limits, Vitals
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import NO_ROUTER, NO_SAMPLES, WAITS, waits_of

LIMITS = Limits(start=20, silence=1.0, stall=1.5, stop=2, first_pause=0.1, settled=3)

WORKER = """
import signal, sys, time
from rigwatch.wire.host import Heartbeat
from rigwatch.wire.host.heartbeat import Heartbeat
run = [True]
signal.signal(signal.SIGTERM, lambda *_: run.clear())
beat = Heartbeat("worker")
beat.ready()
count = 0
while run:
    count += {step}
    beat.advance(count)
    time.sleep(0.02)
beat.stopping()
print("stopped in good order")
"""
FALLS_AT_START = "import sys; print('model.toml: no such file'); sys.exit(2)"
IGNORES_STOP = WORKER.replace("lambda *_: run.clear()", "signal.SIG_IGN")


def worker(name: str, code: str = "", source: str = "", may_finish: bool = False) -> ProcessPlan:
    code = code or WORKER.format(step=1)
    return ProcessPlan(name, (sys.executable, "-c", code), source, may_finish)


def supervise(
    plans: list[ProcessPlan],
    script: Callable[[Supervisor, list[ProcessEvent]], bool],
    seconds: float = 30,
) -> list[ProcessEvent]:
    """Run until `script`, called at every turn, says that it has seen enough."""
    events: list[ProcessEvent] = []
    supervisor = Supervisor(plans, events.append, LIMITS)
    deadline = time.monotonic() + seconds

    def each_turn() -> None:
        assert time.monotonic() < deadline, events
        if script(supervisor, events):
            supervisor.stop()

    supervisor.run(each_turn)
    return events


CORE = min(os.sched_getaffinity(0))


@contextmanager
def busy_core(processes: int) -> Iterator[None]:
    """So many processes that never rest, all on one core."""
    spin = f"import os\nos.sched_setaffinity(0, {{{CORE}}})\nwhile True: pass"
    started = [subprocess.Popen([sys.executable, "-c", spin]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()


def of_kind(events: list[ProcessEvent], process: str, kind: str) -> list[ProcessEvent]:
    return [event for event in events if (event.process, event.kind) == (process, kind)]


def all_ready(supervisor: Supervisor) -> bool:
    return all(w.vitals.ready and w.vitals.count for w in supervisor.processes.values())


def test_a_killed_process_is_started_again_at_once_and_the_other_goes_on() -> None:
    killed: list[int] = []

    def script(supervisor: Supervisor, events: list[ProcessEvent]) -> bool:
        if not killed and all_ready(supervisor):
            killed.append(supervisor.processes["daq"].child.pid)
            os.kill(killed[0], signal.SIGKILL)
        return len(of_kind(events, "daq", "ready")) == 2

    events = supervise([worker("daq"), worker("monitor")], script)
    assert of_kind(events, "daq", "ended")[0].text == "ended by SIGKILL"
    (pause,) = of_kind(events, "daq", "restarting")
    assert pause.text == f"starts again in {LIMITS.first_pause} s"
    assert len(of_kind(events, "monitor", "started")) == 1


def test_a_process_that_hangs_is_killed_and_started_again() -> None:
    def script(supervisor: Supervisor, events: list[ProcessEvent]) -> bool:
        if all_ready(supervisor) and not of_kind(events, "daq", "ill"):
            os.kill(supervisor.processes["daq"].child.pid, signal.SIGSTOP)
        return len(of_kind(events, "daq", "ready")) >= 2

    events = supervise([worker("daq")], script)
    assert of_kind(events, "daq", "ill")[0].text == "hangs: silent for 1 s"


def test_only_a_process_whose_source_has_samples_is_started_again_for_having_none() -> None:
    idle = WORKER.format(step=0)
    plans = [
        worker("plant"),
        worker("daq", idle, source="plant"),
        worker("monitor", idle, source="daq"),
    ]
    events = supervise(plans, lambda _, events: len(of_kind(events, "daq", "ill")) == 2)
    assert "takes no samples" in of_kind(events, "daq", "ill")[0].text
    assert not of_kind(events, "monitor", "ill")


@pytest.mark.nightly
def test_a_process_that_only_waits_for_a_processor_is_not_started_again() -> None:
    # Neither counts a sample; one of them spins behind four others on one core.
    spins = "until = time.monotonic() + 0.1\n    while time.monotonic() < until: pass"
    begins = WORKER.format(step=0).replace("time.sleep(0.02)", spins)
    begins = f"import os\nos.sched_setaffinity(0, {{{CORE}}})\n{begins}"
    plans = [
        worker("plant"),
        worker("daq", WORKER.format(step=0), source="plant"),
        worker("recorder", begins, source="plant"),
    ]
    with busy_core(4):
        events = supervise(plans, lambda _, events: len(of_kind(events, "daq", "ill")) == 2)
    assert not of_kind(events, "recorder", "ill")
    said = [event.text for event in of_kind(events, "recorder", "says")]
    assert said[0] == "passes no samples on for want of processor time"


def test_pauses_grow_and_the_reason_is_the_last_line_that_was_printed() -> None:
    events = supervise(
        [worker("monitor", FALLS_AT_START)],
        lambda _, events: len(of_kind(events, "monitor", "restarting")) == 4,
    )
    pauses = [event.text for event in of_kind(events, "monitor", "restarting")]
    assert pauses == [f"starts again in {pause} s" for pause in (0.1, 0.2, 0.4, 0.8)]
    ended = of_kind(events, "monitor", "ended")[0]
    assert ended.text == "ended with code 2: model.toml: no such file"


def test_a_process_that_cannot_be_started_ends_no_other_and_is_tried_again(tmp_path: Path) -> None:
    program, away = tmp_path / "daq", tmp_path / "being replaced"
    program.write_text(f"#!{sys.executable}\n{WORKER.format(step=1)}")
    program.chmod(0o755)
    open_files: list[int] = []

    def script(supervisor: Supervisor, events: list[ProcessEvent]) -> bool:
        if program.exists() and all_ready(supervisor) and not of_kind(events, "daq", "ended"):
            program.rename(away)  # as while a package is being updated
            os.kill(supervisor.processes["daq"].child.pid, signal.SIGKILL)
        if away.exists() and len(of_kind(events, "daq", "ill")) >= 1:
            open_files.append(len(list(Path("/proc/self/fd").iterdir())))
            if len(of_kind(events, "daq", "ill")) == 3:
                away.rename(program)
        return len(of_kind(events, "daq", "ready")) == 2

    events = supervise([ProcessPlan("daq", (str(program),)), worker("monitor")], script)
    ill = [event.text for event in of_kind(events, "daq", "ill")]
    assert ill == ["cannot be started: no such file or directory"] * 3
    pauses = [event.text for event in of_kind(events, "daq", "restarting")]
    assert pauses == [f"starts again in {pause} s" for pause in (0.1, 0.2, 0.4, 0.8)]
    assert len(of_kind(events, "monitor", "started")) == 1
    assert max(open_files) == open_files[0]


def test_a_simulated_device_is_started_once_those_who_watch_it_are_ready() -> None:
    slow = "import time; time.sleep(1)\n" + WORKER.format(step=1)
    plant = ProcessPlan("plant", worker("plant").arguments, after=("monitor", "not here"))
    events = supervise(
        [plant, worker("monitor", slow)], lambda _, events: bool(of_kind(events, "plant", "ready"))
    )
    order = [(event.process, event.kind) for event in events]
    assert order.index(("monitor", "ready")) < order.index(("plant", "started"))
    assert of_kind(events, "plant", "started")[0].restarts == 0


def test_a_viewer_that_was_closed_stays_closed() -> None:
    events = supervise(
        [worker("dashboard", "pass", may_finish=True)],
        lambda _, events: bool(of_kind(events, "dashboard", "finished")),
    )
    assert len(of_kind(events, "dashboard", "started")) == 1


def test_stopping_goes_backwards_and_nothing_is_left_behind() -> None:
    pids: list[int] = []

    def script(supervisor: Supervisor, _events: list[ProcessEvent]) -> bool:
        if not all_ready(supervisor):
            return False
        pids.extend(w.child.pid for w in supervisor.processes.values())
        return True

    plans = [worker("router"), worker("daq", IGNORES_STOP.format(step=1)), worker("recorder")]
    events = supervise(plans, script)
    stopped = [event for event in events if event.kind == "stopped"]
    assert [event.process for event in stopped] == ["recorder", "daq", "router"]
    assert [event.text.split(":")[0] for event in stopped] == ["stopped", "killed", "stopped"]
    assert [e.text for e in of_kind(events, "recorder", "says")] == ["stopped in good order"]
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)


def test_a_process_that_goes_on_to_stop_is_not_killed() -> None:
    slow = WORKER.replace(
        "beat.stopping()",
        "for _ in range(6):\n    beat.still_stopping(1.0)\n    time.sleep(0.5)",
    )
    plans = [worker("recorder", slow.format(step=1))]
    events = supervise(plans, lambda supervisor, _: all_ready(supervisor))
    assert [event.text for event in of_kind(events, "recorder", "stopped")] == ["stopped"]


def test_a_process_cannot_be_judged_by_words_that_waited_for_a_late_supervisor() -> None:
    vitals = Vitals(0.0)
    vitals.take("READY=1\nX_RIGWATCH_COUNT=5", now=30.0)
    assert vitals.complaint(None, 30.0, LIMITS) == ""


def test_time_to_get_ready_is_not_time_without_samples() -> None:
    source, reader = Vitals(0.0), Vitals(0.0)
    for second in range(31):
        source.take(f"X_RIGWATCH_COUNT={second + 1}", now=float(second))
    reader.take("READY=1", now=29.9)
    assert reader.complaint(source, 30.0, LIMITS) == ""
    for second in (30.5, 31.0, 31.5):
        source.take(f"X_RIGWATCH_COUNT={second * 10:.0f}", now=second)
    reader.take("X_RIGWATCH_COUNT=0", now=31.5)
    assert "takes no samples" in reader.complaint(source, 31.5, LIMITS)


@pytest.mark.parametrize(("silent_for", "ill"), [(0.5, False), (1.5, True)])
def test_silence_is_measured_from_the_last_word(silent_for: float, ill: bool) -> None:
    vitals = Vitals(0.0)
    vitals.take("READY=1", now=10.0)
    assert bool(vitals.complaint(None, 10.0 + silent_for, LIMITS)) is ill


def test_a_source_that_has_just_come_back_gives_its_readers_time() -> None:
    source, reader = Vitals(0.0), Vitals(0.0)
    for vitals in (source, reader):
        vitals.take("X_RIGWATCH_COUNT=5", now=1.0)
    source.take("X_RIGWATCH_COUNT=6", now=100.0)
    reader.take("X_RIGWATCH_COUNT=5", now=100.0)
    assert reader.complaint(source, 100.0, LIMITS) == ""
    source.take("X_RIGWATCH_COUNT=7", now=100.9)
    reader.take("X_RIGWATCH_COUNT=5", now=101.6)
    assert "takes no samples" in reader.complaint(source, 101.6, LIMITS)


def test_a_process_that_says_its_device_is_gone_is_not_started_again_for_having_no_samples() -> (
    None
):
    source, daq = Vitals(0.0), Vitals(0.0, reads_device=True)
    recorder = Vitals(0.0)
    for vitals in (source, daq, recorder):
        vitals.take("READY=1\nX_RIGWATCH_COUNT=5", now=1.0)
    seconds = [0.25 * turn for turn in range(8, 130)]
    for now in seconds:
        source.take(f"X_RIGWATCH_COUNT={now * 256:.0f}", now=now)
        for vitals in (daq, recorder):
            vitals.take("STATUS=waits: no device matches\nX_RIGWATCH_COUNT=5", now=now)
        assert daq.complaint(source, now, LIMITS) == ""
    assert "takes no samples" in recorder.complaint(source, seconds[-1], LIMITS)
    # Plugged in again it has as long as ever to take samples.
    for turn in range(1, round(LIMITS.stall / 0.25) + 2):
        now = seconds[-1] + 0.25 * turn
        source.take(f"X_RIGWATCH_COUNT={now * 256:.0f}", now=now)
        daq.take("STATUS=running\nX_RIGWATCH_COUNT=5", now=now)
        assert bool(daq.complaint(source, now, LIMITS)) == (now > seconds[-1] + LIMITS.stall)


def test_a_daq_that_gets_nothing_of_a_simulated_device_that_has_samples_is_started_again() -> None:
    source, daq = Vitals(0.0), Vitals(0.0, reads_device=True)
    for vitals in (source, daq):
        vitals.take("READY=1\nX_RIGWATCH_COUNT=5", now=1.0)
    for turn in range(8, 16):
        source.take(f"X_RIGWATCH_COUNT={turn * 64}", now=0.25 * turn)
        daq.take(f"STATUS={WAITS}{NO_SAMPLES}\nX_RIGWATCH_COUNT=5", now=0.25 * turn)
    assert "takes no samples" in daq.complaint(source, 0.25 * 15, LIMITS)


def test_a_process_that_waits_for_its_router_is_not_started_again_for_having_no_samples() -> None:
    source, monitor = Vitals(0.0), Vitals(0.0)
    for vitals in (source, monitor):
        vitals.take("READY=1\nX_RIGWATCH_COUNT=5", now=1.0)
    router = Vitals(100.0)  # it starts again, late: what a monitor has to say would end with it
    router.take("READY=1", now=100.0)
    seconds = [0.25 * turn for turn in range(8, 500)]
    ill = []
    for now in seconds:
        source.take(f"X_RIGWATCH_COUNT={now * 256:.0f}", now=now)
        monitor.take(f"STATUS={WAITS}{NO_ROUTER}\nX_RIGWATCH_COUNT=5", now=now)
        if now > 100.0:
            router.take("X_RIGWATCH_COUNT=0", now=now)
        assert monitor.complaint(source, now, LIMITS) == ""  # the router runs elsewhere
        ill += [now] if monitor.complaint(source, now, LIMITS, router) else []
    # A router that has run for long does answer: then the fault is the monitor's own.
    assert min(ill) == 100.0 + LIMITS.stall + 0.25


@pytest.mark.parametrize(
    ("rigs", "waits"),
    [
        (["", NO_ROUTER], ""),
        (["no device", "no device"], "no rig has samples to come"),
        (["no device", NO_ROUTER], NO_ROUTER),
    ],
)
def test_a_process_of_several_rigs_waits_if_all_of_them_do(rigs: list[str], waits: str) -> None:
    assert waits_of(rigs) == waits


def test_a_process_whose_supervisor_was_killed_while_it_started_does_not_start() -> None:
    late = partial(die_with, os.getpid() + 1)
    started = subprocess.run([sys.executable, "-c", ""], check=False, preexec_fn=late)
    assert started.returncode == 1


def test_exit_codes_in_words() -> None:
    assert how_it_ended(-9, "") == "ended by SIGKILL"
    assert how_it_ended(2, "no such port") == "ended with code 2: no such port"


def test_sockets_are_in_memory_where_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "full"))
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr(supervisor, "IN_MEMORY", str(tmp_path))
    made = Supervisor([], lambda _: None)
    assert made._folder.parent == tmp_path
    made._stop_all()
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr(supervisor, "IN_MEMORY", str(tmp_path / "full"))
    with pytest.raises(RigwatchError, match="expected room in TMPDIR"):
        Supervisor([], lambda _: None)

"""The parts of the demonstration: its configuration, its words, its verdict."""

import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import every_command
from rigwatch.demo.commissioning import known_friction
from rigwatch.demo.narrator import Narrator, acts
from rigwatch.demo.own_folder import own_folder
from rigwatch.demo.rig_file import write_rig_file
from rigwatch.demo.show import GO_ON
from rigwatch.demo.verdict import complaints, read_recording
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import PROBABLY_MISSING
from rigwatch.wire.messages.message_types import Alarm, Column, EstimateBlock, Event, SampleBlock
from rigwatch.wire.rig_config import SerialSection, load_rig
from rigwatch.wire.session import SessionWriter, run_info
from rigwatch.wire.typed_files.shipped import find_config
from rigwatch.wire.typed_files.writing import as_toml
from sim_plant.scenario import load_scenario

RATE = 256
CAUSE = "Dry friction has appeared in the actuator."


def alarm(name: str = "dry_friction", seq: int = 5200, state: str = "unacknowledged") -> Alarm:
    return Alarm(
        name=name,
        state=state,  # type: ignore[arg-type]
        severity="error",
        cause=CAUSE if name == "dry_friction" else "Something else.",
        guidance="Stop and look.",
        device="rig",
        boot=7,
        seq=seq,
        t_ns=seq * 3906250,
        value=1.0,
        low=-0.1,
        high=0.1,
        first_out=True,
        user="",
        onset_seq=seq - 20,
    )


def samples(seq: int, n: int, boot: int = 7) -> SampleBlock:
    t_ns = (seq + np.arange(n)) * 3906250
    column = Column("position", "m", np.zeros(n), np.zeros(n, np.uint8))
    return SampleBlock("rig", boot, seq, t_ns // 1000, t_ns, (column,))


def estimates(seq: int, n: int, theta1: float = 0.0) -> EstimateBlock:
    t_ns = (seq + np.arange(n)) * 3906250
    return EstimateBlock("rig", 7, seq, t_ns, (Column("theta1", "", np.full(n, theta1)),))


Recorded = Callable[..., Path]


@pytest.fixture
def recorded(tmp_path: Path) -> Recorded:
    def write(*messages: SampleBlock | EstimateBlock | Alarm) -> Path:
        folder = tmp_path / "sessions" / "demo-1"
        folder.mkdir(parents=True)
        info = run_info("demo", 256.0, t_ns=0, notes="")
        with SessionWriter(folder / "000001.mcap", info) as writer:
            for message in messages:
                writer.write(message)
        return folder

    return write


def test_everything_the_demonstration_writes_is_in_its_folder(tmp_path: Path) -> None:
    config = load_rig(write_rig_file(find_config("demo.toml"), tmp_path, "web"))
    assert isinstance(config.daq.device, SerialSection)
    assert config.plant is not None
    assert config.monitor is not None
    assert config.recorder is not None
    written = (config.daq.device.port, config.monitor.model, config.recorder.folder)
    assert all(Path(path).is_relative_to(tmp_path) for path in written)
    assert config.daq.device.port == config.plant.port


@pytest.mark.parametrize(
    "tree",
    [
        {"a": 1, "b": 1e-7, "c": 'x"y\\z', "d": True, "e": [1.5, 2.0]},
        {"t": {"x": 1, "u": {"y": 2}}, "many": [{"p": 1, "q": {"r": 2}}, {"p": 3, "q": {"r": 4}}]},
        {"t": {"sensor.position": {"on": False}}},
    ],
)
def test_toml_that_is_printed_reads_back_the_same(tree: dict[str, object]) -> None:
    assert tomllib.loads(as_toml(tree)) == tree


def test_acts_follow_the_scenario_through_its_cycles() -> None:
    scenario = load_scenario(find_config("scenarios/demo.toml"))
    told = acts(scenario)
    first, second = (next(told) for _ in range(2))
    assert first.text == "dry friction of 0.43 N begins"
    assert second.text == "the friction ends"
    rest = [next(told) for _ in range(len(scenario.events))]
    again = rest[len(scenario.events) - 2]
    assert again.seq == first.seq + round(scenario.cycle_s * RATE)
    assert (first.played, again.played) == (0, 1)


def narrator_to(said: list[str]) -> Narrator:
    scenario = load_scenario(find_config("scenarios/demo.toml"))
    return Narrator(scenario, said.append, "rig.toml", "demo/studies", known=known_friction())


def test_each_fault_is_told_with_the_commands_to_look_at_it_and_to_acknowledge_it() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    for name, seq in (("dry_friction", 5200), ("other_fault", 9200)):
        narrator.alarm(alarm("departure", seq))
        narrator.alarm(alarm(name, seq))
        narrator.alarm(alarm(name, seq + 500, "cleared_unacknowledged"))
    assert [line.partition("$ ")[2] for line in said if "$" in line] == [
        "rigwatch alarms rig.toml",
        "rigwatch ack rig.toml dry_friction",
        "rigwatch ack rig.toml other_fault",
    ]
    kept = next(number for number, line in enumerate(said) if "an alarm is kept" in line)
    assert "rigwatch alarms" in said[kept - 1]  # while the fault lasts
    advice = [line.strip() for line in said if "what to do" in line]
    assert advice == ["what to do: Stop and look."] * 3  # one a name, of which departure came twice


def test_where_nobody_watches_no_command_is_told_that_needs_the_running_rig() -> None:
    said: list[str] = []
    scenario = load_scenario(find_config("scenarios/demo.toml"))
    narrator = Narrator(scenario, said.append, "rig.toml", known=0.43, attended=False)
    narrator.alarm(alarm())
    narrator.alarm(alarm(state="cleared_unacknowledged"))
    assert any("what to do" in line for line in said)
    assert not any("$" in line for line in said)


def test_the_end_of_an_alarm_that_nobody_was_told_of_is_not_told() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.alarm(alarm("link", 0, "cleared_unacknowledged"))
    narrator.judged(estimates(936, 64))
    assert said == []


def test_an_alarm_is_reported_with_its_cause_and_its_delay_after_what_was_done() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.samples(100)
    assert said == []
    begins = next(acts(load_scenario(find_config("scenarios/demo.toml")))).seq
    narrator.alarm(alarm(seq=begins + 32))
    assert "dry friction of 0.43 N begins" in said[0]
    assert CAUSE in said[1]
    assert "first sign 47 ms after the fault began, named at 125 ms" in said[1]
    assert "Stop and look." in said[2]
    assert any("what is missing in the rig's model follows" in line for line in said)
    said.clear()
    narrator.alarm(alarm("departure", begins + 32))
    assert "alarm raised at 125 ms" in said[0]
    assert not any("what is missing in the rig's model follows" in line for line in said)
    said.clear()
    narrator.alarm(alarm("other_fault", begins + 32))
    assert "dry friction ruled out at 125 ms" in said[0]
    said.clear()
    narrator.alarm(alarm("stale", begins + 900))
    assert "after the fault began" not in said[0]
    assert "ALARM" in said[0]


def test_the_wait_for_the_next_fault_is_told_at_the_start_and_after_each_one() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.begin(5 * RATE)
    assert "the demo puts faults into the rig and takes them out, every 120 s" in said[0]
    assert any("on the dashboard, watch the verdict" in line for line in said)
    assert any("each fault raises two alarms" in line for line in said)
    assert "the first fault comes in 15 s; Ctrl-C ends the demo" in said[-1]
    narrator.samples(40 * RATE)
    assert "dry friction" in said[-1]
    narrator.samples(46 * RATE)
    assert "the next fault comes in 30 s" in said[-1]
    narrator.samples(96 * RATE)
    assert "that was the last of them, and they begin again" in said[-2]
    assert "the first fault comes in 45 s" in said[-1]


def test_a_run_that_nobody_watches_ends_with_the_cause_told_or_a_while_after_the_name() -> None:
    narrator = narrator_to([])
    assert narrator.all_told_at(20.0) == inf
    narrator.alarm(alarm("departure", 20 * RATE))
    assert narrator.all_told_at(20.0) == inf
    narrator.alarm(alarm("dry_friction", 21 * RATE))
    assert narrator.all_told_at(20.0) == 41.0
    narrator.explain(Event("monitor", 0, "error", PROBABLY_MISSING, "probably missing: x@load"))
    assert narrator.all_told_at(20.0) == 29.0
    assert narrator.all_told_at(inf) == inf


@pytest.mark.parametrize(("named", "told"), [("dry_friction", 1), ("other_fault", 0)])
def test_friction_that_was_noticed_as_a_departure_is_told_with_its_size(
    named: str, told: int
) -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.alarm(alarm("departure"))
    narrator.alarm(alarm(named))
    narrator.judged(estimates(5200, 64, 1.02))
    found = "departure: probably missing: coulomb@load (dry surfaces resist sliding)"
    narrator.explain(Event("monitor", 0, "error", PROBABLY_MISSING, found))
    assert sum("measured friction: 0.44 N" in line for line in said) == told


def test_an_explanation_after_the_end_of_the_friction_tells_the_size_that_it_had() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.alarm(alarm("dry_friction", 5200))
    narrator.judged(estimates(5220, 64, 1.02))
    narrator.alarm(alarm("dry_friction", 9000, "cleared_unacknowledged"))
    narrator.judged(estimates(9040, 64, 0.0))
    found = "dry_friction: probably missing: coulomb@load (dry surfaces resist sliding)"
    narrator.explain(Event("monitor", 0, "error", PROBABLY_MISSING, found))
    assert any("measured friction: 0.44 N, 1.02 times" in line for line in said)


def test_an_explanation_says_which_alarm_it_belongs_to() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.alarm(alarm("departure", 20 * RATE))
    narrator.alarm(alarm("dry_friction", 21 * RATE))
    narrator.samples(96 * RATE)
    text = "departure: probably missing: coulomb@load (dry surfaces resist sliding)"
    narrator.explain(Event("monitor", 0, "error", PROBABLY_MISSING, text))
    assert any("the alarm of 20.00 s: probably missing" in line for line in said)


def test_an_alarm_that_names_the_fault_of_an_earlier_one_says_so() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.alarm(alarm("departure", 20 * RATE))
    narrator.alarm(alarm("departure", 21 * RATE, "normal"))
    narrator.alarm(alarm("dry_friction", 21 * RATE))
    named = [line.strip() for line in said if "this names" in line]
    assert named == ["(this names the fault behind the alarm of 20.00 s)"]
    assert sum("follows as a second alarm" in line for line in said) == 1
    said.clear()
    narrator.alarm(alarm("dry_friction", 30 * RATE, "normal"))
    narrator.alarm(alarm("other_fault", 40 * RATE))
    narrator.alarm(alarm("departure", 50 * RATE))
    narrator.alarm(replace(alarm("departure", 60 * RATE, "normal"), onset_seq=50 * RATE))
    narrator.judged(estimates(70 * RATE, 64))
    narrator.alarm(alarm("other_fault", 80 * RATE))
    assert not any("this names" in line for line in said)


def test_an_alarm_that_rules_friction_out_names_nothing() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.alarm(alarm("departure", 20 * RATE))
    narrator.alarm(alarm("other_fault", 21 * RATE))
    told = [line.strip() for line in said if "behind" in line]
    assert told == ["(this tells that no dry friction is behind the alarm of 20.00 s)"]


def test_no_line_of_an_explanation_is_longer_than_the_others() -> None:
    said: list[str] = []
    rivals = "; ".join(["dahl@load explains as much, and neither is settled"] * 4)
    found = f"coulomb@load (dry surfaces resist sliding): explains 99% of the change; {rivals}"
    text = f"dry_friction: probably missing: {found}"
    narrator_to(said).explain(Event("monitor", 0, "error", PROBABLY_MISSING, text))
    assert max(map(len, said)) <= 102
    assert " ".join(line.strip() for line in said).count("neither is settled") == 4


def test_the_address_of_the_workbench_is_told_where_it_is_needed() -> None:
    said: list[str] = []
    scenario = load_scenario(find_config("scenarios/demo.toml"))
    narrator = Narrator(
        scenario, said.append, "rig.toml", "studies", known=0.43, workbench=lambda: "http://here"
    )
    narrator.begin(0)
    assert not any("http://here" in line for line in said), "no alarm can be studied yet"
    narrator.alarm(alarm("departure"))
    narrator.alarm(alarm("dry_friction"))
    assert sum("to study alarms in a browser: http://here" in line for line in said) == 1
    text = "dry_friction: probably missing: coulomb@load (dry surfaces resist sliding)"
    narrator.explain(Event("monitor", 0, "error", PROBABLY_MISSING, text))
    assert any("at the alarm in the workbench (http://here)," in line for line in said)


def test_what_is_missing_in_the_model_is_told_and_other_events_are_not() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    share = "explains 99% of the change since healthy, by chance once in 40"
    rivals = "coulomb at load is settled, by which law is not: dahl@load explains as much"
    found = f"coulomb@load (dry surfaces resist sliding): {share}; {rivals}"
    text = f"dry_friction: probably missing: {found}"
    narrator.explain(Event("daq", 0, "warning", "CLOCK STEP", "the clock stepped"))
    assert not narrator.explained
    narrator.judged(estimates(5200, 64, 1.02))
    narrator.explain(Event("monitor", 0, "error", PROBABLY_MISSING, text))
    assert narrator.explained
    assert [line.strip() for line in said] == [
        "probably missing in the rig's model: coulomb@load",
        "(dry surfaces resist sliding)",
        share,
        rivals,
        "measured friction: 0.44 N, 1.02 times that of the recording",
        "with known friction, from which its model was made",
        "more about it: $ rigwatch effects coulomb",
        "next, how strong it is (the demo goes on meanwhile): Open as a study,",
        "at the alarm in the workbench,",
        "which makes its folder; explain and add it there, or by commands:",
        "$ rigwatch explain demo/studies/dry_friction-*",
        "$ rigwatch add demo/studies/dry_friction-* coulomb --port load",
    ]
    said.clear()
    nothing = "departure: probably missing: cannot tell, the ranking failed"
    narrator.explain(Event("monitor", 0, "error", PROBABLY_MISSING, nothing))
    assert not any("$" in line or "measured friction" in line for line in said)


def test_a_departure_that_gets_a_name_has_not_gone() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.alarm(alarm("departure", 5200))
    narrator.alarm(alarm("departure", 5210, "normal"))
    narrator.samples(7000)
    narrator.judged(estimates(5236, 64))
    narrator.alarm(alarm("dry_friction", 5210))
    narrator.judged(estimates(6936, 64))
    assert not any("departure: the condition has gone" in line for line in said)
    narrator.alarm(alarm("dry_friction", 7100, "normal"))
    assert "dry friction: the condition has gone" in said[-1]
    narrator.alarm(alarm("departure", 8000, "normal"))
    narrator.judged(estimates(8236, 64))
    assert "departure: the condition has gone" in said[-1]


def test_an_alarm_about_the_measuring_chain_is_no_fault_of_the_plan() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    line = replace(alarm("stale", 5200), guidance="Run `rigwatch doctor CONFIG`.")
    narrator.alarm(line)
    assert "none of the faults announced" in said[2]
    assert "rigwatch doctor rig.toml" in said[4]
    narrator.alarm(replace(line, state="cleared_unacknowledged", seq=5300))
    assert any("Something else.: the condition has gone" in told for told in said)
    said.clear()
    narrator.alarm(alarm("other_fault", 6000))
    assert not any("none of the faults announced" in told for told in said)


def test_of_alarms_about_the_measuring_chain_the_first_is_told_and_none_is_studied() -> None:
    said: list[str] = []
    narrator = narrator_to(said)
    narrator.alarm(alarm("stale", 5000))
    narrator.alarm(alarm("dry_friction", 5200))
    narrator.alarm(alarm("stale", 5300))
    narrator.alarm(alarm("alarm_flood", 5400))
    narrator.alarm(alarm("alarm_flood", 5500, "normal"))
    assert sum("ALARM: Something else." in line for line in said) == 1
    assert not any("the condition has gone" in line for line in said)
    missing = "dry_friction: probably missing: coulomb@load (dry surfaces): explains 99%"
    narrator.explain(Event("monitor", 0, "error", PROBABLY_MISSING, missing))
    assert any("rigwatch explain demo/studies/dry_friction-*" in line for line in said)
    narrator.end()
    assert said[-1] == "alarms about the measuring chain that were not told: 2"


def test_a_whole_recording_with_the_alarm_has_nothing_to_complain_about(
    recorded: Recorded,
) -> None:
    path = recorded(samples(0, 512), samples(512, 256), estimates(0, 768), alarm())
    recording = read_recording(path)
    assert (recording.samples, recording.estimates) == (768, 768)
    assert complaints([alarm()], recording, range(8, 768)) == []
    crashed = complaints([alarm()], recording, range(8, 768), exit_code=-9)
    assert crashed == ["rigwatch up ended with code -9"]


@pytest.mark.parametrize(
    ("blocks", "fault"),
    [
        ((samples(0, 512), samples(520, 256)), "samples 512 to 519 are missing"),
        ((samples(64, 768),), "samples 64 to 831 are in it, but 0 to 575 were on the bus"),
        ((samples(0, 512), samples(0, 64, boot=8)), "started again"),
    ],
)
def test_missing_samples_are_found(
    recorded: Recorded, blocks: tuple[SampleBlock, ...], fault: str
) -> None:
    recording = read_recording(recorded(*blocks, estimates(0, 768), alarm()))
    assert fault in " ".join(complaints([alarm()], recording, range(576)))


def test_a_wrong_name_no_alarm_and_no_estimates_are_complained_about(recorded: Recorded) -> None:
    recording = read_recording(recorded(samples(0, 512)))
    early = complaints([], recording, range(512), fault_begun=False)
    assert early == ["it ended before a fault", "no estimates are in the recording"]
    found = complaints([alarm("other_fault")], recording, range(512))
    assert any("no alarm named dry friction; alarms: other_fault" in line for line in found)
    assert any("not in the recording" in line for line in found)
    assert any("no estimates" in line for line in found)


def test_what_it_says_to_go_on_with_are_commands() -> None:
    said = [word for line in GO_ON for word in re.findall(r"rigwatch [a-z]+(?: [a-z]+)*", line)]
    assert len(said) == 3
    assert {name for name, _ in every_command()} >= set(said)


def test_a_second_demonstration_takes_a_folder_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with own_folder(None) as first, own_folder(None) as second:
        assert (first, second) == (Path("demo-session"), Path("demo-session-2"))
        with pytest.raises(RigwatchError, match="another demonstration"), own_folder(second):
            pass
    with own_folder(None) as again:
        assert again == first

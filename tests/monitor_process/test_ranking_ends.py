"""A ranking in the background: what it gets, and how it ends with its monitor, wherever it is."""

import gc
import threading
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from monitor.diagnosis import background_ranking, ranking_job
from monitor.diagnosis.background_ranking import Explainer
from monitor.diagnosis.child import Child
from monitor.model import load_model
from rigwatch.wire.messages.blocks import cut
from rigwatch.wire.messages.message_types import Alarm, Column, EstimateBlock, SampleBlock
from tests.bus.samples import block
from tests.waiting import eventually

RIG = load_model(Path(__file__).parents[1] / "verify" / "model.toml")
ALARM = Alarm(
    "departure", "unacknowledged", "warning", "a cause", "", "rig", 7, 0, 0, 1.0, 0.0, 0.5, True,
    "", 0,
)  # fmt: skip


def explained(explainer: Explainer) -> None:
    """An alarm and enough samples for a ranking to start."""
    samples = block(0, 600)
    change = (Column("change", "m/s^2", np.zeros(600)),)
    explainer.hear(ALARM)
    explainer.take(EstimateBlock("rig", 7, 0, samples.t_ns, change), samples)


def blocks_in_memory() -> int:
    return sum(isinstance(one, SampleBlock) for one in gc.get_objects())


def test_a_ranking_gets_every_sample_and_few_blocks_wait_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    got: list[np.ndarray] = []
    monkeypatch.setattr(
        background_ranking, "ask", lambda *given: got.extend(given[:2]) or "an answer"
    )
    model = structs.replace(RIG, channels=("voltage", "position"))
    explainer, whole, before = Explainer(lambda: model), block(0, 7 * 256), blocks_in_memory()

    def take(seq: int) -> None:
        samples = cut(whole, seq, seq + 7)
        change = (Column("change", "m/s^2", np.arange(seq, seq + 7.0)),)
        explainer.take(EstimateBlock("rig", 7, seq, samples.t_ns, change), samples)

    for seq in (*range(0, 700, 7), *range(900, 1600, 7)):  # samples 700 to 899 are lost
        take(seq)
    assert blocks_in_memory() - before < 100
    explainer.hear(ALARM)
    take(1600)
    eventually(explainer.results, "an answer")
    present = np.r_[0:700, 900:1607]
    expected = np.full(1607, np.nan)
    expected[present] = present
    np.testing.assert_array_equal(got[1], expected)
    for place, name in enumerate(model.channels):
        expected[present] = whole.channel(name).values[present]
        np.testing.assert_array_equal(got[0][:, place], expected)


def test_a_child_that_runs_is_killed_and_one_that_comes_late_never_starts(tmp_path: Path) -> None:
    child, mark = Child(), tmp_path / "runs"
    words = ["-c", f"import time; open({str(mark)!r}, 'w').close(); time.sleep(600)"]
    thread = threading.Thread(target=child.run, args=[words])
    thread.start()
    eventually(mark.exists, "the child runs")
    child.end()
    thread.join()
    mark.unlink()
    child.run(words)
    assert not mark.exists()


@pytest.mark.parametrize("late", [False, True])
def test_a_monitor_that_ends_while_a_ranking_starts_waits_for_no_answer(
    late: bool, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    started, go_on = threading.Event(), threading.Event()

    def held(*given: object) -> str:
        child = given[-1]
        assert isinstance(child, Child)
        started.set()
        assert go_on.wait(60.0)
        child.run(["-c", "import time; time.sleep(600)"])
        return "an answer"

    monkeypatch.setattr(background_ranking, "ask", held)
    monkeypatch.setattr(background_ranking, "_arrays", lambda *_: (np.zeros((1, 1)), np.zeros(1)))
    explainer = Explainer(lambda: RIG)
    explained(explainer)
    assert started.wait(60.0)
    if late:
        threading.Timer(0.1, go_on.set).start()
    else:
        go_on.set()
    explainer.close()
    assert explainer.results() == []
    assert "Traceback" not in capfd.readouterr().err


def test_a_ranking_that_cannot_be_started_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(background_ranking, "ask", full)
    monkeypatch.setattr(background_ranking, "_arrays", lambda *_: (np.zeros((1, 1)), np.zeros(1)))
    explainer = Explainer(lambda: RIG)
    explained(explainer)
    found = []
    eventually(lambda: found.extend(explainer.results()) or found, "an answer")
    why = "the ranking failed: its process could not be started: no space left on the disk"
    assert why in found[0].text


@pytest.mark.parametrize(
    ("code", "why"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGALRM)", "it took more than 300 s"),
        ("import os; os.abort()", "its process was ended by SIGABRT"),
        ("raise SystemExit(3)", "its process ended with code 3"),
    ],
)
def test_why_a_ranking_has_ended_without_an_answer_is_told(
    code: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "endings.py").write_text(code)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(ranking_job, "MODULE", "endings")
    text = ranking_job.ask(np.zeros((1, 1)), np.zeros(1), 0, RIG, ())
    assert text.startswith(f"probably missing: cannot tell, the ranking failed: {why}")

"""docs/rig-story.md as it is typed: a rig on a real line, an alarm, a study, a promoted model."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.bus.connection import connect
from rigwatch.wire.messages.message_types import EstimateBlock, Event
from rigwatch.wire.messages.topics import ESTIMATES, EVENTS
from rigwatch.wire.rig_config import load_rig
from tests.bus.rig import ROOT, free_port
from tests.waiting import eventually

PAGE = (ROOT / "docs" / "rig-story.md").read_text(encoding="utf-8")
RATE, ENOUGH = 256, 21 * 256


def typed() -> list[str]:
    """The page's commands, in order."""
    blocks = re.findall(r"```\n(.*?)```", PAGE, re.DOTALL)
    lines = "".join(blocks).splitlines()
    return [line.split("#")[0].strip() for line in lines if line.startswith("rigwatch")]


class Shell:
    """A folder in which the page's commands are typed; what is left running ends with it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(ROOT / "configs", folder / "configs")
        self.config = folder / "configs" / "story.toml"
        text = self.config.read_text(encoding="utf-8").replace("7447", str(free_port()))
        text = text.replace("/tmp/rigwatch-story", str(folder / "line"))
        self.config.write_text(text, encoding="utf-8")
        self.running: list[subprocess.Popen[bytes]] = []

    def type(self, command: str) -> str:
        """The command's output; empty where it continues in the background."""
        words = command.replace("rigwatch ", f"{sys.executable} -m rigwatch ", 1)
        setting = {"cwd": self.folder, "env": {**os.environ, "PYTHONPATH": str(ROOT)}}
        if words.endswith("&"):
            words = "exec " + words.rstrip("& ") + " --without dashboard"
            process = subprocess.Popen(words, shell=True, stdout=subprocess.DEVNULL, **setting)  # type: ignore[call-overload]
            self.running.append(process)
            return ""
        done = subprocess.run(
            words, shell=True, capture_output=True, text=True, timeout=300, check=False, **setting
        )  # type: ignore[call-overload]
        assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
        return str(done.stdout)

    def close(self) -> None:
        for process in self.running:
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0


class Watched:
    """Estimates and events as they come, of all samples so far."""

    def __init__(self, config: Path) -> None:
        self._bus = connect(load_rig(config), "observer", 60.0)
        self._estimates = self._bus.subscribe_lossy(ESTIMATES)
        self._blocks: list[EstimateBlock] = []
        self._events = self._bus.subscribe(EVENTS)

    def last(self) -> int:
        """Samples that have been judged so far."""
        self._blocks = [*self._blocks, *self._estimates.drain()][-RATE:]
        return self._blocks[-1].seq + len(self._blocks[-1]) if self._blocks else 0

    def events(self) -> list[Event]:
        """Those that have come since they were last asked for."""
        return list(self._events.drain())

    def lately(self, name: str) -> np.ndarray:
        """A column over the newest second."""
        self.last()
        return np.concatenate([b.column(name).values for b in self._blocks])[-RATE:]

    def residual(self) -> float:
        return float(np.sqrt(np.mean(self.lately("residual") ** 2)))

    def wait_for(self, samples: int) -> None:
        eventually(lambda: self.last() >= samples, f"{samples} samples")

    def wait_until_armed(self) -> None:
        self.wait_for(self.last() + 2 * RATE)
        eventually(lambda: bool(self.lately("armed").all()), "the monitor watches again")

    def close(self) -> None:
        self._bus.close()


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = Shell(tmp_path)
    yield made
    made.close()


@pytest.mark.nightly
@pytest.mark.parametrize("asked", ["explain", "the alarm has told the effect"])
def test_the_story_of_the_rig_as_it_is_typed(shell: Shell, asked: str) -> None:
    commission, up, alarms, *study, promote, rollback = typed()
    assert "--commission-only" in commission
    # What that command makes takes ten seconds and is part of the recordings that tests verify.
    (shell.folder / "story").mkdir()
    shutil.copy(ROOT / "tests" / "verify" / "model.toml", shell.folder / "story" / "model.toml")
    shell.type(up)
    watched = Watched(shell.config)
    try:
        watched.wait_for(ENOUGH)
        told = "probably missing: coulomb@load"
        eventually(
            lambda: any(told in event.text for event in watched.events()),
            "the monitor has found what is missing",
        )
        assert told in shell.type(alarms)
        *begun, explain, add, compare = study
        for command in begun:
            shell.type(command)
        if asked == "explain":
            explained = shell.type(explain)
            ranking = explained.partition("effect@port")[2].splitlines()[1]
            assert ranking.split()[0] == "coulomb@load", explained
        added, compared = shell.type(add), shell.type(compare)
        assert "coulomb@load: held-out error" in added
        friction = re.search(r"load_coulomb_Fc\s+(\S+)", compared)
        assert friction is not None
        assert float(friction[1]) == pytest.approx(0.12, rel=0.1)
        before = watched.residual()
        shell.type(promote)
        watched.wait_until_armed()
        assert watched.residual() < 0.7 * before
        shell.type(rollback)
        watched.wait_until_armed()
        assert watched.residual() == pytest.approx(before, rel=0.3)
        assert not watched.lately("theta1").max() > 0.3, "what rubs is learnt as healthy"
    finally:
        watched.close()

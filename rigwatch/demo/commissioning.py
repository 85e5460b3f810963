"""The monitor's model for the demonstration, made as on a real rig: record, then commission.

The commands are shown as they run. Their results are cached under a hash of all inputs.
"""

import hashlib
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import daq
import monitor
import sim_plant
from rigwatch import physics, wire
from rigwatch.demo.rig_file import MODEL, relative
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files import find_config
from sim_plant.scenario import load_scenario

RECORDINGS = {
    "chirp": "scenarios/commissioning_chirp.toml",
    "healthy": "scenarios/healthy_sine_8hz_1v4.toml",
    "friction": "scenarios/known_friction.toml",
}
"""The recordings for commissioning, by role, and the scenario of each."""
WHAT = {
    "chirp": "the healthy rig, driven from slow to fast",
    "healthy": "the healthy rig in its usual motion",
    "friction": "the same motion with a friction of known size",
}
"""What each of them shows."""
STEPS = len(RECORDINGS) + 2


def known_friction() -> float:
    """The dry friction of the third recording, which the monitor takes as its unit [N]."""
    (event,) = load_scenario(find_config(RECORDINGS["friction"])).events
    return event.value


def ensure_model(config: Path, folder: Path, say: Callable[[str], None]) -> Path:
    """The model for the simulated rig of `config`, rebuilt if anything has changed.

    Raises:
        ModelError: a step failed.
    """
    model, stamp = folder / MODEL, folder / "model.made-from"
    made_from = _made_from(config)
    if model.is_file() and stamp.is_file() and stamp.read_text(encoding="utf-8") == made_from:
        say(f"model of the healthy rig: {relative(model)}, made before and up to date")
        return model
    say("commissioning: first the monitor learns how the healthy rig moves, as on a real rig:")
    say("  three recordings, and a model: a file that says which acceleration the healthy rig")
    say("  answers its drive with, and by how many m/s² the measured one differs without a fault;")
    say("  nothing is shown in a browser before that")
    say(f"  {STEPS} commands run here by themselves, about a minute in all, more on a busy machine")
    say("  (later runs use the same model)")
    sessions = {role: folder / "commissioning" / f"{role}.mcap" for role in RECORDINGS}
    for number, (role, session) in enumerate(sessions.items(), 1):
        session.parent.mkdir(parents=True, exist_ok=True)
        session.unlink(missing_ok=True)
        scenario = find_config(RECORDINGS[role])
        say(f"  {number} of {STEPS}: recording {WHAT[role]}")
        _run(["plant", "--session", session, scenario], say)
    roles = [part for role, session in sessions.items() for part in (f"--{role}", session)]
    say(f"  {STEPS - 1} of {STEPS}: making the model, {relative(model)}, from the recordings")
    _run(["commission", *roles, "--scheme", "transfer", "--output", model], say)
    # The trial also compiles the monitor's kernels, so that the live monitor starts quickly.
    say(f"  {STEPS} of {STEPS}: trying the model: the monitor runs over the last recording")
    say("    (the longest of them, as the monitor is compiled first)")
    _run(["replay", sessions["friction"], "--model", model], say)
    stamp.write_text(made_from, encoding="utf-8")
    return model


def _run(arguments: list[str | Path], say: Callable[[str], None]) -> None:
    words = [relative(word) if isinstance(word, Path) else word for word in arguments]
    say(f"    $ rigwatch {shlex.join(words)}")
    command = [sys.executable, "-m", "rigwatch", *words]
    begun = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        reason = (done.stderr or done.stdout).strip().splitlines() or ["no reason given"]
        raise ModelError(f"rigwatch {words[0]} failed: {reason[-1]}")
    say(f"      done after {time.monotonic() - begun:.0f} s")


def _made_from(config: Path) -> str:
    """A hash of the configuration, the scenarios and the code behind the model."""
    scenarios = [find_config(name) for name in RECORDINGS.values()]
    found = hashlib.sha256()
    for path in [config, *scenarios, *_sources()]:
        found.update(path.read_bytes())
    return found.hexdigest()


def _sources() -> Iterator[Path]:
    for package in (daq, monitor, sim_plant, physics, wire):
        assert package.__file__ is not None
        yield from sorted(Path(package.__file__).parent.rglob("*.py"))

"""Runs the monitor over recordings: replay for people, comparison with references in CI."""

from rigwatch.replay.cases import Verdict, load_cases, verify
from rigwatch.replay.choice import monitor_for
from rigwatch.replay.run import Replay, replay

__all__ = ["Replay", "Verdict", "load_cases", "monitor_for", "replay", "verify"]

"""Chooses the model and the alarm settings for the replay of a session."""

from functools import lru_cache
from pathlib import Path

from monitor.detectors import FRICTION, detectors_of
from monitor.model import RigModel, parse_model
from monitor.pipeline import RigMonitor
from rigwatch.replay.run import check_suits
from rigwatch.wire.errors import ConfigError, SessionError
from rigwatch.wire.rig_config import MonitorSection, RigConfig, load_rig
from rigwatch.wire.session import Session
from rigwatch.wire.typed_files import parse, read_text


def monitor_for(session: Session, model: Path | None, config: Path | None) -> RigMonitor:
    """A new monitor for the session.

    Args:
        session: the recording.
        model: the model file; None takes the one in the configuration.
        config: the rig's configuration; None takes the one recorded with the session.

    Raises:
        ConfigError: the model or the configuration is wrong.
        SessionError: no model is named anywhere, or it was made for another rate.
    """
    section, file = _section(session, config)
    path = model or (Path(section.model) if section else None)
    if path is None:
        raise SessionError(f"{session.path}: found no model in its configuration, expected --model")
    loaded = _parsed(read_text(path), str(path))
    check_suits(session, loaded)
    if section is None:
        return RigMonitor(loaded)
    detectors = detectors_of(section.detectors, loaded, file)
    watches_friction = FRICTION in section.detectors
    return RigMonitor(loaded, section.alarms, detectors, file, watches_friction)


@lru_cache(maxsize=4)
def _parsed(text: str, name: str) -> RigModel:
    """The model in a file's text; remembered, as thousands of recordings are judged by one."""
    return parse_model(text, name)


def _section(session: Session, config: Path | None) -> tuple[MonitorSection | None, str]:
    """[monitor] of the given or the recorded configuration, and that configuration's name."""
    if config is not None:
        return load_rig(config).monitor, str(config)
    name = f"configuration in {session.path}"
    if not session.info.configuration:
        return None, name
    try:
        return parse(session.info.configuration, RigConfig, name).monitor, name
    except ConfigError:
        # Recorded by another version: its alarm settings may not apply, its samples do.
        return None, name

"""The files of a demonstration, and of a study, as a version leaves them.

    rigwatch demo ──▶ its folder ──▶ tests/versions/DAY/ rig.toml, model.toml, session.mcap,
            positions, alarms.jsonl with its position, rigwatch-index/, formats.toml, left.toml
    two kept logs ──▶ a study of them, with an effect ──▶ tests/versions/DAY/study/
    an identity ──▶ a device as daq remembers it ──▶ tests/versions/DAY/alarms.jsonl.device
    the session's alarms ──▶ a file of sent alarms ──▶ tests/versions/DAY/alarms.jsonl.said

Of the session stay two seconds after friction was named, and the folder is renamed to /var/lib/rig.
`left.toml` says what was read of the files when they were kept; `tests/versions` compares it with
what is read of them now.
"""

import hashlib
import tempfile
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from shutil import copy
from typing import Any

from daq.known_device import KnownDevice, read_devices
from monitor.alarms import AlarmManager, read_journal
from monitor.process.cursor import Cursor
from rigwatch.archive import Store, index
from rigwatch.commands import main as rigwatch
from rigwatch.recorder import load_positions, newest
from rigwatch.wire.bus import KeptMessages
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages import Alarm, decode, encode
from rigwatch.wire.ordering import OPEN, Ask, Numbered
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import Session, open_session, trim
from rigwatch.wire.session.edit import copy_messages
from rigwatch.wire.typed_files import as_toml
from rigwatch.workbench.study import create
from tools.keep_version import formats

VERSIONS = Path(__file__).parents[2] / "tests" / "versions"
LOGS = VERSIONS / "2026-11-23" / "study"
"""Folder of two logs of a motor, of which every version makes a study."""
STUDY = """model = "motor"
start = { R = 2.0, K = 0.06, J = 0.0002 }

[[train]]
session = "run1.mcap"

[[held_out]]
session = "run2.mcap"
"""
EFFECT = "coulomb@shaft"
DEVICE = "rigwatch, simulated rig, RX-2 no. 4711"
PLACE = "/var/lib/rig"
AFTER, LENGTH = 256, 588
"""The part of the session that is kept: samples from the naming of friction on, and how many."""
FRICTION = "dry_friction"
SENT, SENT_HALF, RUN = "alarms.jsonl.said", 1 << 14, 5
"""File of the alarms that were sent, size of its halves [bytes], and run that sent them."""
CONSTANT = VERSIONS / "2026-11-24" / "session.mcap"
"""A recording that stays the same, for the digests of formats."""
FILES = ("model.toml", "alarms.jsonl", "alarms.jsonl.position")


def keep(demo: Path, versions: Path) -> Path:
    """Keep the files of a demonstration.

    Args:
        demo: its folder.
        versions: folder of the kept versions.

    Returns:
        the new folder, named by the day of the recording; with a number if that day has one.

    Raises:
        RigwatchError: the demonstration's files cannot be read.
    """
    config = load_rig(demo / "rig.toml")
    assert config.recorder is not None
    written = str(Path(config.recorder.folder).parent)  # as the configuration spells the folder
    text = (demo / "rig.toml").read_text("utf-8").replace(f'"{written}/', f'"{PLACE}/')
    session = open_session(newest(demo / "sessions", config.rig.id))
    day = datetime.fromtimestamp(session.info.t_ns / 1e9, UTC).strftime("%Y-%m-%d")
    target = _new_folder(versions, day)
    (target / "rig.toml").write_text(text, "utf-8")
    for name in FILES:
        copy(demo / name, target)
    copy(session.path / "positions", target)
    _keep_session(session, text, target / "session.mcap")
    index(Store(str(target)))
    (target / "rigwatch-index" / "lock").unlink(missing_ok=True)
    _keep_study(target / "study")
    KnownDevice("daq", target / "alarms.jsonl.device").admits(DEVICE)
    _keep_sent(target)
    (target / formats.NAME).write_text(as_toml(formats.digests(CONSTANT)), "utf-8")
    (target / "left.toml").write_text(as_toml(left_in(target)), "utf-8")
    return target


def _new_folder(versions: Path, day: str) -> Path:
    names = (day, *(f"{day}-{number}" for number in range(2, 100)))
    target = next(path for name in names if not (path := versions / name).exists())
    target.mkdir()
    return target


def _keep_sent(target: Path) -> None:
    """The alarms of the session as a run that has sent them and ended leaves them."""
    sent = KeptMessages(target / SENT, SENT_HALF)
    sent.begin(RUN)
    alarms = (item.message for item in open_session(target / "session.mcap").messages(["alarms"]))
    for number, alarm in enumerate(alarms):
        sent.write(Numbered(RUN, number, encode(alarm)))
    sent.close()


def _keep_study(folder: Path) -> None:
    """A study of the kept logs, with an effect."""
    with tempfile.TemporaryDirectory() as made:
        template = Path(made, "template.toml")
        template.write_text(STUDY, "utf-8")
        create(folder, template, LOGS)
    if rigwatch(["add", str(folder), EFFECT]) != 0:
        raise ModelError(f"{folder}: the effect {EFFECT} is not accepted")


def _keep_session(session: Session, configuration: str, target: Path) -> None:
    """The part after friction was named, with the configuration that is kept beside it."""
    alarms = (item.message for item in session.messages(["alarms"]))
    named = next(one for one in alarms if one.name == FRICTION)
    times = [
        int(t_ns)
        for block in session.samples()
        for seq, t_ns in zip(range(block.seq, block.seq + len(block)), block.t_ns, strict=True)
        if named.seq + AFTER <= seq <= named.seq + AFTER + LENGTH
    ]
    with tempfile.TemporaryDirectory() as folder:
        trim(session, Path(folder, "part.mcap"), times[0], times[-1])
        part = open_session(Path(folder, "part.mcap"))
        sha256 = hashlib.sha256(configuration.encode()).hexdigest()
        run = replace(part.info, configuration=configuration, configuration_sha256=sha256)
        copy_messages(part.messages(), run, target)


def left_in(version: Path) -> dict[str, Any]:
    """What is read of a kept version's files.

    Args:
        version: its folder.

    Returns:
        `software` that wrote the session; its `samples` and `estimates`; `friction`, the state of
        the friction alarm in the journal; `position`, the number of the monitor's last sample;
        `recorded`, that of the recorder's last message of estimates, `device`, what the rig's
        device told of itself, and `sent`, the number of alarms sent, where they are kept.
    """
    session = open_session(version / "session.mcap")
    records, _ = read_journal(version / "alarms.jsonl")
    manager = AlarmManager()
    manager.restore(list({record.alarm.name: record for record in records}.values()))
    states = {alarm.name: alarm.state for alarm in manager.standing()}
    with tempfile.TemporaryDirectory() as folder:
        # A monitor maps its own file, and may write it.
        place = Cursor(Path(copy(version / "alarms.jsonl.position", folder))).read()
        sent = _sent(version / SENT, Path(folder))
    devices = read_devices(version / "alarms.jsonl.device")
    kept = load_positions(version).get("estimates", {}).get("monitor")
    return {
        "software": session.info.software,
        "samples": sum(map(len, session.samples())),
        "estimates": sum(map(len, session.estimates())),
        "friction": states.get(FRICTION, "normal"),
        "position": -1 if place is None else place[1],
        **({"recorded": kept[1]} if kept else {}),
        **({"device": devices[-1].identity} if devices else {}),
        **({"sent": sent} if sent else {}),
    }


def _sent(path: Path, folder: Path) -> int:
    """How many alarms the run in a file has sent, read from a copy; 0 without a file."""
    if not path.exists():
        return 0
    reply = KeptMessages(copy(path, folder), SENT_HALF).past.reply(Ask(RUN, 0, OPEN))
    return sum(bool(decode(Alarm, one.payload).name) for one in reply.blocks)
